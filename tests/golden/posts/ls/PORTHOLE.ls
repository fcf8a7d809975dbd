/PROG  PORTHOLE
/ATTR
OWNER       = MNEDITOR;
COMMENT     = "PORTHOLE";
PROG_SIZE   = 0;
FILE_NAME   = ;
VERSION     = 0;
LINE_COUNT  = 38;
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
   6:  !points stand in UFRAME[1] of the ;
   7:  !controller, which must be the ;
   8:  !scan frame ;
   9:  !points: mm and degrees, R = ;
  10:  !Rz(R) Ry(P) Rx(W), tool Z points ;
  11:  !out of the flange into the work ;
  12:  !points between cuts are blended: ;
  13:  !within 0.5 mm, corners cut by ;
  14:  !0.05 mm at most ;
  15:  UFRAME_NUM=1 ;
  16:  UTOOL_NUM=1 ;
  17:  !tool 3 LOADTL/3 ;
  18:  !stop: start spindle cw, 12000 ;
  19:  !rev/min ;
  20:  MESSAGE[stop: start spindle cw,] ;
  21:  PAUSE ;
  22:J P[1] 10% FINE    ;
  23:  !coolant on: no output is named ;
  24:  !for it ;
  25:L P[2] 200cm/min CNT50    ;
  26:  !first side ;
  27:L P[3] 200cm/min FINE    ;
  28:  WAIT   1.50(sec) ;
  29:L P[4] 15mm/sec FINE    ;
  30:  !stop: STOP ;
  31:  MESSAGE[stop: STOP] ;
  32:  PAUSE ;
  33:L P[5] 15mm/sec FINE    ;
  34:L P[6] 250mm/sec FINE    ;
  35:  !coolant off: no output is named ;
  36:  !for it ;
  37:  !spindle off: no output is named ;
  38:  !for it ;
/POS
P[1]{
   GP1:
    UF : 1, UT : 1,        CONFIG : 'N U T, 0, 0, 0',
    X = 100.0000  mm,    Y = 0.0000  mm,    Z = 5.0000  mm,
    W = 180.0000 deg,    P = 16.6992 deg,    R = 0.0000 deg
};
P[2]{
   GP1:
    UF : 1, UT : 1,        CONFIG : 'N U T, 0, 0, 0',
    X = 98.0067  mm,    Y = 19.8669  mm,    Z = 5.0286  mm,
    W = 176.4456 deg,    P = 16.3271 deg,    R = -1.0004 deg
};
P[3]{
   GP1:
    UF : 1, UT : 1,        CONFIG : 'N U T, 0, 0, 0',
    X = 92.1061  mm,    Y = 38.9418  mm,    Z = 5.0571  mm,
    W = 173.0925 deg,    P = 15.2408 deg,    R = -1.8240 deg
};
P[4]{
   GP1:
    UF : 1, UT : 1,        CONFIG : 'N U T, 0, 0, 0',
    X = 82.5336  mm,    Y = 56.4642  mm,    Z = 5.0857  mm,
    W = 170.1089 deg,    P = 13.5225 deg,    R = -2.3348 deg
};
P[5]{
   GP1:
    UF : 1, UT : 1,        CONFIG : 'N U T, 0, 0, 0',
    X = 69.6707  mm,    Y = 71.7356  mm,    Z = 5.1143  mm,
    W = 167.6115 deg,    P = 11.2866 deg,    R = -2.4616 deg
};
P[6]{
   GP1:
    UF : 1, UT : 1,        CONFIG : 'N U T, 0, 0, 0',
    X = 54.0302  mm,    Y = 84.1471  mm,    Z = 5.1429  mm,
    W = 165.6654 deg,    P = 8.6578 deg,    R = -2.2029 deg
};
/END
