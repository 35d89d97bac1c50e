//! `spts_tests::parsers::answer`.
#![no_main]
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| spts_tests::parsers::answer(bytes));
