/PROG  PORTHOLE_TEST
/ATTR
OWNER       = MNEDITOR;
COMMENT     = "PORTHOLE_TEST";
PROG_SIZE   = 0;
FILE_NAME   = ;
VERSION     = 0;
LINE_COUNT  = 73;
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
   1:  !PORTHOLE_test ;
   2:  !self-test: manual mode, low ;
   3:  !speed, finger on the stop ;
   4:  !corrected by sicp_cam ;
   5:  !gates: all passed ;
   6:  !not a safety function: verify at ;
   7:  !reduced speed ;
   8:  !UFRAME[1] is the pose of the ;
   9:  !part in the robot's world: the ;
  10:  !option cell times its pose in ;
  11:  !the scan frame ;
  12:  !points: mm and degrees, R = ;
  13:  !Rz(R) Ry(P) Rx(W), tool Z points ;
  14:  !out of the flange into the work ;
  15:  !first run: no blending, no ;
  16:  !straight move faster than 50 ;
  17:  !mm/s ;
  18:  !the world of most arms lies at ;
  19:  !the height of axis 2 ;
  20:  !UFRAME[1] X=550 Y=100 Z=225 ;
  21:  !W=3.9902 P=-12.1336 R=106.8361 ;
  22:  !UTOOL[1] X=0 Y=0 Z=150 W=0 P=0 ;
  23:  !R=0 ;
  24:  PR[99]=P[1]    ;
  25:  UFRAME[1]=PR[99] ;
  26:  PR[99]=P[2]    ;
  27:  UTOOL[1]=PR[99] ;
  28:  PAYLOAD[2] ;
  29:  UFRAME_NUM=1 ;
  30:  UTOOL_NUM=1 ;
  31:  !stop: goes 50 mm off the origin, ;
  32:  !along the tool ;
  33:  MESSAGE[stop: goes 50 mm off the] ;
  34:  PAUSE ;
  35:J P[3] 1% FINE    ;
  36:  !stop: 50 mm off the origin, ;
  37:  !along the tool? ;
  38:  MESSAGE[stop: 50 mm off the orig] ;
  39:  PAUSE ;
  40:L P[4] 10mm/sec FINE    ;
  41:  !stop: moved 50 mm to +X? ;
  42:  MESSAGE[stop: moved 50 mm to +X?] ;
  43:  PAUSE ;
  44:L P[5] 10mm/sec FINE    ;
  45:  !stop: back? ;
  46:  MESSAGE[stop: back?] ;
  47:  PAUSE ;
  48:L P[6] 10mm/sec FINE    ;
  49:  !stop: moved 50 mm to +Y? ;
  50:  MESSAGE[stop: moved 50 mm to +Y?] ;
  51:  PAUSE ;
  52:L P[7] 10mm/sec FINE    ;
  53:  !stop: back? ;
  54:  MESSAGE[stop: back?] ;
  55:  PAUSE ;
  56:L P[8] 10mm/sec FINE    ;
  57:  !stop: leans 15 deg to +X, tip ;
  58:  !stays? ;
  59:  MESSAGE[stop: leans 15 deg to +X] ;
  60:  PAUSE ;
  61:L P[9] 10mm/sec FINE    ;
  62:  !stop: back? ;
  63:  MESSAGE[stop: back?] ;
  64:  PAUSE ;
  65:L P[10] 10mm/sec FINE    ;
  66:  !stop: leans 15 deg to +Y, tip ;
  67:  !stays? ;
  68:  MESSAGE[stop: leans 15 deg to +Y] ;
  69:  PAUSE ;
  70:L P[11] 10mm/sec FINE    ;
  71:  !stop: back? ;
  72:  MESSAGE[stop: back?] ;
  73:  PAUSE ;
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
P[3]{
   GP1:
    UF : 1, UT : 1,        CONFIG : 'N U T, 0, 0, 0',
    X = 0.0000  mm,    Y = 0.0000  mm,    Z = 50.0000  mm,
    W = 180.0000 deg,    P = 0.0000 deg,    R = 0.0000 deg
};
P[4]{
   GP1:
    UF : 1, UT : 1,        CONFIG : 'N U T, 0, 0, 0',
    X = 50.0000  mm,    Y = 0.0000  mm,    Z = 50.0000  mm,
    W = 180.0000 deg,    P = 0.0000 deg,    R = 0.0000 deg
};
P[5]{
   GP1:
    UF : 1, UT : 1,        CONFIG : 'N U T, 0, 0, 0',
    X = 0.0000  mm,    Y = 0.0000  mm,    Z = 50.0000  mm,
    W = 180.0000 deg,    P = 0.0000 deg,    R = 0.0000 deg
};
P[6]{
   GP1:
    UF : 1, UT : 1,        CONFIG : 'N U T, 0, 0, 0',
    X = 0.0000  mm,    Y = 50.0000  mm,    Z = 50.0000  mm,
    W = 180.0000 deg,    P = 0.0000 deg,    R = 0.0000 deg
};
P[7]{
   GP1:
    UF : 1, UT : 1,        CONFIG : 'N U T, 0, 0, 0',
    X = 0.0000  mm,    Y = 0.0000  mm,    Z = 50.0000  mm,
    W = 180.0000 deg,    P = 0.0000 deg,    R = 0.0000 deg
};
P[8]{
   GP1:
    UF : 1, UT : 1,        CONFIG : 'N U T, 0, 0, 0',
    X = 0.0000  mm,    Y = 0.0000  mm,    Z = 50.0000  mm,
    W = 180.0000 deg,    P = 15.0000 deg,    R = 0.0000 deg
};
P[9]{
   GP1:
    UF : 1, UT : 1,        CONFIG : 'N U T, 0, 0, 0',
    X = 0.0000  mm,    Y = 0.0000  mm,    Z = 50.0000  mm,
    W = 180.0000 deg,    P = 0.0000 deg,    R = 0.0000 deg
};
P[10]{
   GP1:
    UF : 1, UT : 1,        CONFIG : 'N U T, 0, 0, 0',
    X = 0.0000  mm,    Y = 0.0000  mm,    Z = 50.0000  mm,
    W = 165.0000 deg,    P = 0.0000 deg,    R = 0.0000 deg
};
P[11]{
   GP1:
    UF : 1, UT : 1,        CONFIG : 'N U T, 0, 0, 0',
    X = 0.0000  mm,    Y = 0.0000  mm,    Z = 50.0000  mm,
    W = 180.0000 deg,    P = 0.0000 deg,    R = 0.0000 deg
};
/END
