MODULE HelloRobotsNextxe
  PERS tooldata tTool1:=[TRUE,[[0,0,0],[1,0,0,0]],[0.001,[0,0,0.001],[1,0,0,0],0,0,0]];
  PERS wobjdata wPart:=[FALSE,TRUE,"",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
  CONST speeddata vStart:=[250,500,5000,1000];
  CONST speeddata vCut0:=[10,500,5000,1000];
  PROC main()
    ! Hello "Robots" Next (x) ; % ' ]]> e ?
    ! Hello "Robots" Next (x) ; % ' ]]> e ?
    ! ]0;x bell
    ! (msg,active)
    ! not a safety function: verify at reduced speed
    ! wPart is the pose of the scan frame; no cell is given, so the scan frame
    ! is taken as the robot's world
    ! points: mm and quaternions, scalar first; tool Z points out of the
    ! flange into the work
    ! points between cuts are blended: within 0.5 mm, corners cut by 0.05 mm
    ! at most
    ConfL \Off;
    ConfJ \Off;
    WaitRob \InPos;
    ! stop: teach tool and cell, not stated
    TPWrite "stop: teach tool and cell, not stated";
    Stop;
    ! tool 1 Hello "Robots" Next (x) ; % ' ]]> e ?
    MoveJ [[0.0000,0.0000,5.0000],[0.0000000,0.9894004,0.0000000,-0.1452131],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vStart,fine,tTool1\WObj:=wPart;
    ! Hello "Robots" Next (x) ; % ' ]]> e ?
    WaitRob \InPos;
    ! stop: Hello "Robots" Next (x) ; % ' ]]> e ?
    TPWrite "stop: Hello Robots Next (x) ; % ' ]]> e";
    Stop;
    MoveL [[10.0000,0.0000,5.0000],[0.1229484,0.9893538,-0.0096024,-0.0772694],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vCut0,fine,tTool1\WObj:=wPart;
  ENDPROC
ENDMODULE
