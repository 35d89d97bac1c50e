//! The cell firmware of the single-pixel tactile skin: its protocol and behaviour.
