//! The README's worked example, run as it stands.

use crate::command::Folder;

const README: &str = include_str!("../README.md");

/// The fenced blocks of a Markdown text: info string and contents.
fn blocks(text: &str) -> Vec<(&str, String)> {
    let mut blocks = Vec::new();
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        if let Some(info) = line.strip_prefix("```") {
            let body = lines.by_ref().take_while(|line| !line.starts_with("```"));
            blocks.push((info, body.flat_map(|line| [line, "\n"]).collect()));
        }
    }
    blocks
}

/// Runs a command; `> file` takes its standard output.
fn run(folder: &Folder, command: &str) {
    let Some((arguments, file)) = command.split_once(" > ") else {
        folder.run(command);
        return;
    };
    let output = folder.command(arguments).output().unwrap();
    assert!(output.status.success(), "{command}");
    folder.write(file, output.stdout);
}

#[test]
fn every_command_runs_and_every_shown_file_is_the_one_produced() {
    let folder = Folder::new();
    let (mut n_commands, mut n_results) = (0, 0);
    for (info, body) in blocks(README) {
        match info.split_once(' ') {
            // Shown before a command made it: an input. After: a result.
            Some((_, file)) if folder.path(file).exists() => {
                assert_eq!(folder.read(file), body, "{file}");
                n_results += 1;
            }
            Some((_, file)) => folder.write(file, body),
            None if info == "sh" => {
                for command in body
                    .lines()
                    .filter_map(|line| line.strip_prefix("torque-gp "))
                {
                    run(&folder, command);
                    n_commands += 1;
                }
            }
            None => {}
        }
    }
    assert!(
        n_commands >= 9 && n_results >= 3,
        "{n_commands} commands, {n_results} results"
    );
}
