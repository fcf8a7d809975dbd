/PROG  PORTHOLE
/ATTR
OWNER       = MNEDITOR;
COMMENT     = "PORTHOLE";
PROG_SIZE   = 0;
FILE_NAME   = ;
VERSION     = 0;
LINE_COUNT  = 30;
MEMORY_SIZE = 0;
PROTECT     = READ_WRITE;
TCD:  STACK_SIZE    = 0,
      TASK_PRIORITY = 50,
      TIME_SLICE    = 0,
      BUSY_LAMP_OFF = 0,
      ABORT_REQUEST = 0,
      PAUSE_REQUEST = 0;
DEFAULT_GROUP   = 1,*,*,*,*;
CONTROL_CODE    = 00000000 00000000;
/APPL
/MN
   1:  !porthole ;
   2:  !corrected by sicp_cam ;
   3:  !gates: all passed ;
   4:  !not a safety function: verify at ;
   5:  !reduced speed ;
   6:  !UFRAME[1] is the pose of the ;
   7:  !part in the robot's world: the ;
   8:  !option cell times its pose in ;
   9:  !the scan frame ;
  10:  !points: mm and degrees, R = ;
  11:  !Rz(R) Ry(P) Rx(W), tool Z points ;
  12:  !out of the flange into the work ;
  13:  !points between cuts are blended: ;
  14:  !within 0.5 mm, corners cut by ;
  15:  !0.05 mm at most ;
  16:  !the world of most arms lies at ;
  17:  !the height of axis 2 ;
  18:  !UFRAME[1] X=550 Y=100 Z=225 ;
  19:  !W=3.9902 P=-12.1336 R=106.8361 ;
  20:  !UTOOL[1] X=0 Y=0 Z=150 W=0 P=0 ;
  21:  !R=0 ;
  22:  PR[99]=P[1]    ;
  23:  UFRAME[1]=PR[99] ;
  24:  PR[99]=P[2]    ;
  25:  UTOOL[1]=PR[99] ;
  26:  PAYLOAD[2] ;
  27:  UFRAME_NUM=1 ;
  28:  UTOOL_NUM=1 ;
  29:  CALL PORTHOLE_001    ;
  30:  CALL PORTHOLE_002    ;
/POS
P[1]{
   GP1:
    UF : 0, UT : 1,        CONFIG : 'N U T, 0, 0, 0',
    X = 550.0000  mm,    Y = 100.0000  mm,    Z = 225.0000  mm,
    W = 3.9902 deg,    P = -12.1336 deg,    R = 106.8361 deg
};
P[2]{
   GP1:
    UF : 0, UT : 1,        CONFIG : 'N U T, 0, 0, 0',
    X = 0.0000  mm,    Y = 0.0000  mm,    Z = 150.0000  mm,
    W = 0.0000 deg,    P = 0.0000 deg,    R = 0.0000 deg
};
/END
