/PROG  PORTHOLE_002
/ATTR
OWNER       = MNEDITOR;
COMMENT     = "PORTHOLE_002";
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
   3:  WAIT   1.50(sec) ;
   4:L P[3] 15mm/sec FINE    ;
   5:  !stop: STOP ;
   6:  MESSAGE[stop: STOP] ;
   7:  PAUSE ;
   8:L P[4] 15mm/sec FINE    ;
   9:L P[5] 250mm/sec FINE    ;
  10:  RO[2]=OFF ;
  11:  DO[1]=OFF ;
/POS
P[3]{
   GP1:
    UF : 1, UT : 1,        CONFIG : 'N U T, 0, 0, 0',
    X = 82.5336  mm,    Y = 56.4642  mm,    Z = 5.0857  mm,
    W = 170.1089 deg,    P = 13.5225 deg,    R = -2.3348 deg
};
P[4]{
   GP1:
    UF : 1, UT : 1,        CONFIG : 'N U T, 0, 0, 0',
    X = 69.6707  mm,    Y = 71.7356  mm,    Z = 5.1143  mm,
    W = 167.6115 deg,    P = 11.2866 deg,    R = -2.4616 deg
};
P[5]{
   GP1:
    UF : 1, UT : 1,        CONFIG : 'N U T, 0, 0, 0',
    X = 54.0302  mm,    Y = 84.1471  mm,    Z = 5.1429  mm,
    W = 165.6654 deg,    P = 8.6578 deg,    R = -2.2029 deg
};
/END
