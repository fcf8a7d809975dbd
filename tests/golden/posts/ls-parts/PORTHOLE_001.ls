/PROG  PORTHOLE_001
/ATTR
OWNER       = MNEDITOR;
COMMENT     = "PORTHOLE_001";
PROG_SIZE   = 0;
FILE_NAME   = ;
VERSION     = 0;
LINE_COUNT  = 11;
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
   1:  UFRAME_NUM=1 ;
   2:  UTOOL_NUM=1 ;
   3:  !tool 3 LOADTL/3 ;
   4:  !spindle 12000 rev/min clockwise ;
   5:  DO[1]=ON ;
   6:  WAIT   2.00(sec) ;
   7:J P[3] 10% FINE    ;
   8:  RO[2]=ON ;
   9:L P[4] 200cm/min CNT50    ;
  10:  !first side ;
  11:L P[5] 200cm/min FINE    ;
/POS
P[3]{
   GP1:
    UF : 1, UT : 1,        CONFIG : 'N U T, 0, 0, 0',
    X = 100.0000  mm,    Y = 0.0000  mm,    Z = 5.0000  mm,
    W = 180.0000 deg,    P = 16.6992 deg,    R = 0.0000 deg
};
P[4]{
   GP1:
    UF : 1, UT : 1,        CONFIG : 'N U T, 0, 0, 0',
    X = 98.0067  mm,    Y = 19.8669  mm,    Z = 5.0286  mm,
    W = 176.4456 deg,    P = 16.3271 deg,    R = -1.0004 deg
};
P[5]{
   GP1:
    UF : 1, UT : 1,        CONFIG : 'N U T, 0, 0, 0',
    X = 92.1061  mm,    Y = 38.9418  mm,    Z = 5.0571  mm,
    W = 173.0925 deg,    P = 15.2408 deg,    R = -1.8240 deg
};
/END
