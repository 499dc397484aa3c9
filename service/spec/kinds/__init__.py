"""The kinds of studies: what a field of a spec about its cases makes of a study; `registry` names them."""
