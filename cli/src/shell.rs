//! Names in commands that can be copied: a shell has to take each for one word, and the program none for a flag.

use std::path::Path;

/// A path as a word of a command.
pub fn path(path: &Path) -> String {
    let text = path.display().to_string();
    match text.starts_with('-') {
        // As a path it is no flag.
        true => word(&format!("./{text}")),
        false => word(&text),
    }
}

/// A text as a word of a command, in quotes if it needs some.
pub fn word(text: &str) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "-_./:=@%+,".contains(c);
    // A path of Windows is full of what is special elsewhere, and its shells know other quotes.
    let is_plain = |c: char| is_plain(c) || (cfg!(windows) && c == '\\');
    match (
        !text.is_empty() && text.chars().all(is_plain),
        cfg!(windows),
    ) {
        (true, _) => text.to_owned(),
        (false, true) => format!("\"{text}\""),
        (false, false) => format!("'{}'", text.replace('\'', r"'\''")),
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::process::Command;

    #[test]
    fn a_shell_takes_a_name_for_one_word() {
        for name in ["kick", "runs/kick-2", "größe.fbx", "C:x=1,2"] {
            assert_eq!(word(name), name);
        }
        for name in [
            "my kick", "it's", "$HOME", "a`b`", "a|b", "a;b", "", "*", "~", "\"x\"", "a\\b", "#1",
            "(x)",
        ] {
            let line = format!("printf '%s' {}", word(name));
            let said = Command::new("sh").args(["-c", &line]).output().expect("sh");
            assert_eq!(String::from_utf8_lossy(&said.stdout), name, "{line}");
        }
    }

    #[test]
    fn a_path_is_no_flag() {
        assert_eq!(path(Path::new("-kick")), "./-kick");
        assert_eq!(path(Path::new("--my kick")), "'./--my kick'");
        assert_eq!(path(Path::new("runs/-kick")), "runs/-kick");
    }
}
