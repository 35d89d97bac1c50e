//! `spts_tests::parsers::npz`.
#![no_main]
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| spts_tests::parsers::npz(bytes));
