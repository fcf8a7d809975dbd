%%%
  VERSION:1
  LANGUAGE:ENGLISH
%%%
MODULE Trim(SYSMODULE)
  CONST robtarget p10:=[[100,0,50],[0,1,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p20:=[[200,0,50],[0,0.7071068,0.7071068,0],
    [0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  VAR speeddata vCut:=[33.3,500,5000,1000];
  CONST jointtarget home:=[[0,0,0,0,90,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PERS tooldata tTrim:=[TRUE,[[0,0,100],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];
  PROC main()
    ! trim; "the rim"
    MoveAbsJ home,v1000,z50,tTrim;
    ConfL\Off;
    MoveJ p10,v1000,z50,tTrim\WObj:=wPart;
    SetDO doSpindle,1;
    WaitTime 2;
    cut;
    IF di1=1 THEN SetDO do2,1; ENDIF
    MoveL Offs(p20,0,0,10),v100,fine,tTrim\WObj:=wPart;
    MoveC [[210,10,60],[0,1,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],
      Offs(p20,20,0,10),vCut,z1,tTrim\WObj:=wPart;
    MoveL RelTool(p20,0,5,-30\Rz:=30),v50\V:=20,z1,tTrim\WObj:=wPart;
    MoveAbsJ home\NoEOffs,v1000,z50,tTrim;
  ENDPROC
  PROC cut()
    MoveL p20,vCut,z1,tTrim\WObj:=wPart;
  ERROR
    RAISE;
  ENDPROC
ENDMODULE
