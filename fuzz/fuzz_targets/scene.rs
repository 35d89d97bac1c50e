//! `spts_tests::parsers::scene`.
#![no_main]
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| spts_tests::parsers::scene(bytes));
