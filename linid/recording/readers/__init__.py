"""One file per export format; `registry` lists them, `reader.Reader` says what each must offer."""
