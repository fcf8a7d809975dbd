/PROG  HELLO
/ATTR
OWNER       = MNEDITOR;
COMMENT     = "HELLO";
PROG_SIZE   = 0;
FILE_NAME   = ;
VERSION     = 0;
LINE_COUNT  = 29;
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
   1:  !Hello "Robots" Next (x) , % ' ;
   2:  !]]> e ? ;
   3:  !Hello "Robots" Next (x) , % ' ;
   4:  !]]> e ? ;
   5:  !]0,x bell ;
   6:  !(msg,active) ;
   7:  !not a safety function: verify at ;
   8:  !reduced speed ;
   9:  !points stand in UFRAME[1] of the ;
  10:  !controller, which must be the ;
  11:  !scan frame ;
  12:  !points: mm and degrees, R = ;
  13:  !Rz(R) Ry(P) Rx(W), tool Z points ;
  14:  !out of the flange into the work ;
  15:  !points between cuts are blended: ;
  16:  !within 0.5 mm, corners cut by ;
  17:  !0.05 mm at most ;
  18:  UFRAME_NUM=1 ;
  19:  UTOOL_NUM=1 ;
  20:  !tool 1 Hello "Robots" Next (x) , ;
  21:  !% ' ]]> e ? ;
  22:J P[1] 10% FINE    ;
  23:  !Hello "Robots" Next (x) , % ' ;
  24:  !]]> e ? ;
  25:  !stop: Hello "Robots" Next (x) , ;
  26:  !% ' ]]> e ? ;
  27:  MESSAGE[stop: Hello "Robots" Nex] ;
  28:  PAUSE ;
  29:L P[2] 10mm/sec FINE    ;
/POS
P[1]{
   GP1:
    UF : 1, UT : 1,        CONFIG : 'N U T, 0, 0, 0',
    X = 0.0000  mm,    Y = 0.0000  mm,    Z = 5.0000  mm,
    W = 180.0000 deg,    P = 16.6992 deg,    R = 0.0000 deg
};
P[2]{
   GP1:
    UF : 1, UT : 1,        CONFIG : 'N U T, 0, 0, 0',
    X = 10.0000  mm,    Y = 0.0000  mm,    Z = 5.0000  mm,
    W = 165.6654 deg,    P = 8.6578 deg,    R = -2.2029 deg
};
/END
