/* A drive table, as it lies in flash. */
  .section .rodata
  .global table_begin
  .global table_end
  .balign 4
table_begin:
  .incbin "table.chl"
table_end:

#ifdef ON_THIS_MACHINE
  .section .note.GNU-stack, "", @progbits
#endif
