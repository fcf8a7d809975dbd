MODULE porthole_test
  PERS tooldata tTool:=[TRUE,[[0,0,150],[1,0,0,0]],[8.5,[0,2,90],[1,0,0,0],0,0,0]];
  PERS wobjdata wPart:=[FALSE,TRUE,"",[[500,0,200],[0.707106781,0,0,0.707106781]],[[100,-50,25],[0.982550982,0.049708843,-0.099417687,0.14912653]]];
  CONST speeddata vStart:=[50,500,5000,1000];
  CONST speeddata vCut0:=[10,500,5000,1000];
  PROC main()
    ! porthole_test
    ! self-test: manual mode, low speed, finger on the stop
    ! corrected by sicp_cam
    ! gates: all passed
    ! not a safety function: verify at reduced speed
    ! wPart is the pose of the part in the robot's world: the option cell
    ! times its pose in the scan frame
    ! points: mm and quaternions, scalar first; tool Z points out of the
    ! flange into the work
    ! first run: no blending, no straight move faster than 50 mm/s
    ConfL \Off;
    ConfJ \Off;
    WaitRob \InPos;
    ! stop: goes 50 mm off the origin, along the tool
    TPWrite "stop: goes 50 mm off the origin, along t";
    Stop;
    MoveJ [[0.0000,0.0000,50.0000],[0.0000000,1.0000000,0.0000000,0.0000000],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vStart,fine,tTool\WObj:=wPart;
    WaitRob \InPos;
    ! stop: 50 mm off the origin, along the tool?
    TPWrite "stop: 50 mm off the origin, along the to";
    Stop;
    MoveL [[50.0000,0.0000,50.0000],[0.0000000,1.0000000,0.0000000,0.0000000],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vCut0,fine,tTool\WObj:=wPart;
    WaitRob \InPos;
    ! stop: moved 50 mm to +X?
    TPWrite "stop: moved 50 mm to +X?";
    Stop;
    MoveL [[0.0000,0.0000,50.0000],[0.0000000,1.0000000,0.0000000,0.0000000],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vCut0,fine,tTool\WObj:=wPart;
    WaitRob \InPos;
    ! stop: back?
    TPWrite "stop: back?";
    Stop;
    MoveL [[0.0000,50.0000,50.0000],[0.0000000,1.0000000,0.0000000,0.0000000],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vCut0,fine,tTool\WObj:=wPart;
    WaitRob \InPos;
    ! stop: moved 50 mm to +Y?
    TPWrite "stop: moved 50 mm to +Y?";
    Stop;
    MoveL [[0.0000,0.0000,50.0000],[0.0000000,1.0000000,0.0000000,0.0000000],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vCut0,fine,tTool\WObj:=wPart;
    WaitRob \InPos;
    ! stop: back?
    TPWrite "stop: back?";
    Stop;
    MoveL [[0.0000,0.0000,50.0000],[0.0000000,0.9914449,0.0000000,-0.1305262],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vCut0,fine,tTool\WObj:=wPart;
    WaitRob \InPos;
    ! stop: leans 15 deg to +X, tip stays?
    TPWrite "stop: leans 15 deg to +X, tip stays?";
    Stop;
    MoveL [[0.0000,0.0000,50.0000],[0.0000000,1.0000000,0.0000000,0.0000000],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vCut0,fine,tTool\WObj:=wPart;
    WaitRob \InPos;
    ! stop: back?
    TPWrite "stop: back?";
    Stop;
    MoveL [[0.0000,0.0000,50.0000],[0.1305262,0.9914449,0.0000000,0.0000000],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vCut0,fine,tTool\WObj:=wPart;
    WaitRob \InPos;
    ! stop: leans 15 deg to +Y, tip stays?
    TPWrite "stop: leans 15 deg to +Y, tip stays?";
    Stop;
    MoveL [[0.0000,0.0000,50.0000],[0.0000000,1.0000000,0.0000000,0.0000000],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vCut0,fine,tTool\WObj:=wPart;
    WaitRob \InPos;
    ! stop: back?
    TPWrite "stop: back?";
    Stop;
  ENDPROC
ENDMODULE
