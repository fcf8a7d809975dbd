/PROG  PORTHOLE_TEST
/ATTR
OWNER       = MNEDITOR;
COMMENT     = "PORTHOLE_TEST";
PROG_SIZE   = 0;
FILE_NAME   = ;
VERSION     = 0;
LINE_COUNT  = 75;
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
  15:  !first run: no blending, no move ;
  16:  !faster than 50 mm/s ;
  17:  !the world of most arms lies at ;
  18:  !the height of axis 2 ;
  19:  !UFRAME[1] X=550 Y=100 Z=225 ;
  20:  !W=3.9902 P=-12.1336 R=106.8361 ;
  21:  !UTOOL[1] X=0 Y=0 Z=150 W=0 P=0 ;
  22:  !R=0 ;
  23:  PR[99]=P[1]    ;
  24:  UFRAME[1]=PR[99] ;
  25:  PR[99]=P[2]    ;
  26:  UTOOL[1]=PR[99] ;
  27:  PAYLOAD[2] ;
  28:  UFRAME_NUM=1 ;
  29:  UTOOL_NUM=1 ;
  30:J P[3] 10% FINE    ;
  31:  !stop: see that the tip is at 50 ;
  32:  !mm above the origin of the ;
  33:  !frame, along its Z ;
  34:  MESSAGE[stop: see that the tip i] ;
  35:  PAUSE ;
  36:L P[4] 10mm/sec FINE    ;
  37:  !stop: see that the tip has moved ;
  38:  !50 mm along +X of the frame ;
  39:  MESSAGE[stop: see that the tip h] ;
  40:  PAUSE ;
  41:L P[5] 10mm/sec FINE    ;
  42:  !stop: see that the tip is back ;
  43:  MESSAGE[stop: see that the tip i] ;
  44:  PAUSE ;
  45:L P[6] 10mm/sec FINE    ;
  46:  !stop: see that the tip has moved ;
  47:  !50 mm along +Y of the frame ;
  48:  MESSAGE[stop: see that the tip h] ;
  49:  PAUSE ;
  50:L P[7] 10mm/sec FINE    ;
  51:  !stop: see that the tip is back ;
  52:  MESSAGE[stop: see that the tip i] ;
  53:  PAUSE ;
  54:L P[8] 10mm/sec FINE    ;
  55:  !stop: see that the holder leans ;
  56:  !15 degrees towards +X, the tip ;
  57:  !has not moved ;
  58:  MESSAGE[stop: see that the holde] ;
  59:  PAUSE ;
  60:L P[9] 10mm/sec FINE    ;
  61:  !stop: see that the holder is ;
  62:  !back ;
  63:  MESSAGE[stop: see that the holde] ;
  64:  PAUSE ;
  65:L P[10] 10mm/sec FINE    ;
  66:  !stop: see that the holder leans ;
  67:  !15 degrees towards +Y, the tip ;
  68:  !has not moved ;
  69:  MESSAGE[stop: see that the holde] ;
  70:  PAUSE ;
  71:L P[11] 10mm/sec FINE    ;
  72:  !stop: see that the holder is ;
  73:  !back ;
  74:  MESSAGE[stop: see that the holde] ;
  75:  PAUSE ;
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
