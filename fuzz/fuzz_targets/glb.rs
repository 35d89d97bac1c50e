//! `spts_tests::parsers::glb`.
#![no_main]
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| spts_tests::parsers::glb(bytes));
