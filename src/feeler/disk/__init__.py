"""Files, journals and keys: how bytes come in and go out, and what a kept result depends on."""
