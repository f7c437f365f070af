//! A folder with a payload file for each context.

use std::path::Path;

use torque_model::LoadDescription;

use crate::error::CliError;
use crate::payload_file::PayloadFile;

/// What is carried in each of some contexts, in their order: NAME.toml of the folder for context NAME, nothing for those
/// that are bare.
///
/// # Errors
/// A context without a file that is not bare, or bare with a file; files that are no payloads, or name different links,
/// in whose axes their centres cannot be compared.
pub fn read(
    folder: &Path,
    contexts: &[String],
    bare: &[&str],
) -> Result<Vec<LoadDescription>, CliError> {
    let mut links: Vec<(String, Option<String>)> = Vec::new();
    let mut loads = Vec::new();
    for context in contexts {
        let path = folder.join(format!("{context}.toml"));
        let (is_bare, file) = (bare.contains(&context.as_str()), path.display().to_string());
        match (path.is_file(), is_bare) {
            (true, true) => {
                return Err(CliError::Usage(format!(
                    "--bare {context}: {file} says that something is carried in it"
                )));
            }
            (false, true) => loads.push(LoadDescription::NOTHING),
            (false, false) => {
                return Err(CliError::Usage(format!(
                    "--payloads {}: context `{context}` has no file {context}.toml there; if nothing is carried in it, \
                     say --bare {context}",
                    folder.display()
                )));
            }
            (true, false) => {
                let load = PayloadFile::read(&path)?;
                loads.push(LoadDescription::from(&load.payload));
                links.push((file, load.link));
            }
        }
    }
    require_one_link(&links)?;
    Ok(loads)
}

fn require_one_link(links: &[(String, Option<String>)]) -> Result<(), CliError> {
    let Some((first, link)) = links.first() else {
        return Ok(());
    };
    let in_words = |link: Option<&str>| match link {
        Some(link) => format!("link = \"{link}\""),
        None => "no `link`".to_owned(),
    };
    match links.iter().find(|(_, other)| other != link) {
        None => Ok(()),
        Some((file, other)) => Err(CliError::Payload {
            file: file.clone(),
            reason: format!(
                "{}, but {first} has {}: centres must be in the axes of one link",
                in_words(other.as_deref()),
                in_words(link.as_deref())
            ),
        }),
    }
}
