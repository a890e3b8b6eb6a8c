# SPDX-License-Identifier: MIT
# IN, a text, becomes a C string "idl_text" in OUT.
file(READ ${IN} lines)
string(REPLACE "\\" "\\\\" lines "${lines}")
string(REPLACE "\"" "\\\"" lines "${lines}")
string(REPLACE "\n" "\\n\"\n\t\"" lines "${lines}")
file(WRITE ${OUT} "extern const char idl_text[];\nconst char idl_text[] =\n\t\"${lines}\";\n")
