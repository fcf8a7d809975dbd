MODULE porthole
  PERS tooldata tTool3:=[TRUE,[[0,0,150],[1,0,0,0]],[8.5,[0,2,90],[1,0,0,0],0,0,0]];
  PERS wobjdata wPart:=[FALSE,TRUE,"",[[500,0,200],[0.707106781,0,0,0.707106781]],[[100,-50,25],[0.982550982,0.049708843,-0.099417687,0.14912653]]];
  CONST speeddata vStart:=[250,500,5000,1000];
  CONST speeddata vRapid:=[250,500,5000,1000];
  CONST speeddata vCut0:=[33.3333,500,5000,1000];
  CONST speeddata vCut1:=[15,500,5000,1000];
  CONST zonedata zCut0:=[FALSE,0.5,0.5,0.5,0.05,0.5,0.05];
  PROC main()
    ! porthole
    ! corrected by sicp_cam
    ! gates: all passed
    ! not a safety function: verify at reduced speed
    ! wPart is the pose of the part in the robot's world: the option cell
    ! times its pose in the scan frame
    ! points: mm and quaternions, scalar first; tool Z points out of the
    ! flange into the work
    ! points between cuts are blended: within 0.5 mm, corners cut by 0.05 mm
    ! at most
    ConfL \Off;
    ConfJ \Off;
    porthole_001p;
    porthole_002p;
  ENDPROC
ENDMODULE
