//! `spts_tests::parsers::image`.
#![no_main]
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| spts_tests::parsers::image(bytes));
