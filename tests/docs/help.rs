//! The help of every command: examples that the program takes, and a text and a default for every option.

use super::{commands, refused};
use clap::{Arg, ArgAction, Command, CommandFactory as _};
use spts_cli::Cli;

/// Columns that help is printed in on a wide terminal.
const WIDTH: usize = 120;

/// All commands below `command`, each with its name as it is typed.
fn below(command: &Command, name: &str) -> Vec<(String, Command)> {
    let shown = command.get_subcommands().filter(|inner| !inner.is_hide_set());
    let inner = shown.flat_map(|inner| {
        let name = format!("{name} {}", inner.get_name());
        let mut found = below(inner, &name);
        found.push((name, inner.clone()));
        found
    });
    inner.collect()
}

/// Every command of the program.
fn all() -> Vec<(String, Command)> {
    let found = below(&Cli::command(), "spts");
    assert!(found.len() > 25, "{} commands", found.len());
    found
}

/// What a command takes, but for `--help` and `--version`.
fn arguments(command: &Command) -> impl Iterator<Item = &Arg> {
    command.get_arguments().filter(|argument| !matches!(argument.get_id().as_str(), "help" | "version"))
}

fn text_after(command: &Command) -> String {
    command.get_after_help().map(ToString::to_string).unwrap_or_default()
}

#[test]
fn every_command_that_takes_arguments_has_examples_that_the_program_takes() {
    let mut seen = 0;
    for (name, command) in all().iter().filter(|(_, command)| arguments(command).next().is_some()) {
        let text = text_after(command);
        let examples = text.strip_prefix("Examples:\n").unwrap_or_default();
        let lines: Vec<&str> = examples.lines().take_while(|line| !line.is_empty()).collect();
        assert!(!lines.is_empty(), "`{name}`: its help does not go on with examples: {text}");
        let mut own = false;
        for line in lines {
            // a remark stands further to the right
            let line = line.trim().split("  ").next().unwrap_or_default();
            for words in commands(line) {
                assert_eq!(refused(&words), None, "`{name}`: {line}");
                own |= words.join(" ").contains(&name["spts".len()..]);
                seen += 1;
            }
        }
        assert!(own, "`{name}`: no example shows it");
    }
    assert!(seen > 100, "{seen} examples");
}

#[test]
fn every_argument_has_a_text_and_every_option_says_its_default() {
    let mut gaps = Vec::new();
    for (name, command) in all() {
        for argument in arguments(&command) {
            let help = argument.get_help().map(ToString::to_string).unwrap_or_default();
            if help.trim().is_empty() {
                gaps.push(format!("{name}: {argument} has no text"));
            }
            let takes_values = matches!(argument.get_action(), ArgAction::Set | ArgAction::Append);
            let is_option = takes_values && argument.get_long().is_some() && !argument.is_required_set();
            if is_option && argument.get_default_values().is_empty() && !help.contains("[default: ") {
                gaps.push(format!("{name}: {argument} does not say its default"));
            }
        }
    }
    assert!(gaps.is_empty(), "{gaps:#?}");
}

/// A table of files that is wider than the terminal is torn apart.
#[test]
fn what_follows_the_options_fits_into_a_wide_terminal() {
    let mut wide = Vec::new();
    for (name, command) in all() {
        let text = text_after(&command);
        wide.extend(text.lines().filter(|line| line.chars().count() > WIDTH).map(|line| format!("{name}: {line}")));
    }
    assert!(wide.is_empty(), "{wide:#?}");
}
