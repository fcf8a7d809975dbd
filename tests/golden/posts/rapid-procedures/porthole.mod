MODULE porthole
  CONST speeddata vStart:=[250,500,5000,1000];
  CONST speeddata vRapid:=[250,500,5000,1000];
  CONST speeddata vCut0:=[33.3333,500,5000,1000];
  CONST speeddata vCut1:=[15,500,5000,1000];
  CONST zonedata zCut0:=[FALSE,0.5,0.5,0.5,0.05,0.5,0.05];
  PROC run_porthole()
    ! porthole
    ! corrected by sicp_cam
    ! gates: all passed
    ! not a safety function: verify at reduced speed
    ! points stand in wFix of the controller, which must be the scan frame
    ! points: mm and quaternions, scalar first; tool Z points out of the
    ! flange into the work
    ! points between cuts are blended: within 0.5 mm, corners cut by 0.05 mm
    ! at most
    ConfL \Off;
    ConfJ \On;
    porthole_001p;
    porthole_002p;
  ENDPROC
  PROC porthole_001p()
    ! tool 3 LOADTL/3
    WaitRob \InPos;
    ! stop: start spindle cw, 12000 rev/min
    TPWrite "stop: start spindle cw, 12000 rev/min";
    Stop;
    MoveJ [[100.0000,0.0000,5.0000],[0.0000000,0.9894004,0.0000000,-0.1452131],[0,-1,0,1],[9E9,9E9,9E9,9E9,9E9,9E9]],vStart,fine,tSpindle\WObj:=wFix;
    ! coolant on: no output is named for it
    MoveL [[98.0067,19.8669,5.0286],[0.0294581,0.9893913,-0.0042337,-0.1421938],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vCut0,zCut0,tSpindle\WObj:=wFix;
    ! first side
    MoveL [[92.1061,38.9418,5.0571],[0.0575960,0.9893700,-0.0077602,-0.1333025],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vCut0,fine,tSpindle\WObj:=wFix;
  ENDPROC
  PROC porthole_002p()
    WaitRob \InPos;
    WaitTime 1.5;
    MoveL [[82.5336,56.4642,5.0857],[0.0832017,0.9893498,-0.0100088,-0.1190140],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vCut1,fine,tSpindle\WObj:=wFix;
    WaitRob \InPos;
    ! stop: STOP
    TPWrite "stop: STOP";
    Stop;
    MoveL [[69.6707,71.7356,5.1143],[0.1052518,0.9893431,-0.0106433,-0.1000445],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vCut1,fine,tSpindle\WObj:=wFix;
    MoveL [[54.0302,84.1471,5.1429],[0.1229484,0.9893538,-0.0096024,-0.0772694],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vRapid,fine,tSpindle\WObj:=wFix;
    ! coolant off: no output is named for it
    ! spindle off: no output is named for it
  ENDPROC
ENDMODULE
