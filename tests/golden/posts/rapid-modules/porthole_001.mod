MODULE porthole_001
  PROC porthole_001p()
    ! tool 3 LOADTL/3
    WaitRob \InPos;
    ! spindle 12000 rev/min clockwise
    SetDO doSpindle,1;
    WaitTime 2;
    MoveJ [[100.0000,0.0000,5.0000],[0.0000000,0.9894004,0.0000000,-0.1452131],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vStart,fine,tTool3\WObj:=wPart;
    WaitRob \InPos;
    SetDO doCool,1;
    MoveL [[98.0067,19.8669,5.0286],[0.0294581,0.9893913,-0.0042337,-0.1421938],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vCut0,zCut0,tTool3\WObj:=wPart;
    ! first side
    MoveL [[92.1061,38.9418,5.0571],[0.0575960,0.9893700,-0.0077602,-0.1333025],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vCut0,fine,tTool3\WObj:=wPart;
  ENDPROC
ENDMODULE
