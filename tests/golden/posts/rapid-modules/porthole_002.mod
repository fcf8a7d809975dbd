MODULE porthole_002
  PROC porthole_002p()
    WaitRob \InPos;
    WaitTime 1.5;
    MoveL [[82.5336,56.4642,5.0857],[0.0832017,0.9893498,-0.0100088,-0.1190140],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vCut1,fine,tTool3\WObj:=wPart;
    WaitRob \InPos;
    ! stop: STOP
    TPWrite "stop: STOP";
    Stop;
    MoveL [[69.6707,71.7356,5.1143],[0.1052518,0.9893431,-0.0106433,-0.1000445],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vCut1,fine,tTool3\WObj:=wPart;
    MoveL [[54.0302,84.1471,5.1429],[0.1229484,0.9893538,-0.0096024,-0.0772694],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vRapid,fine,tTool3\WObj:=wPart;
    WaitRob \InPos;
    SetDO doCool,0;
    WaitRob \InPos;
    SetDO doSpindle,0;
  ENDPROC
ENDMODULE
