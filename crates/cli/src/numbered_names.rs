//! Names numbered in the order in which they appear.

use std::collections::BTreeMap;

/// Names and their numbers, from zero.
#[derive(Debug, Default)]
pub struct NumberedNames {
    numbers: BTreeMap<String, usize>,
    names: Vec<String>,
}

impl NumberedNames {
    /// The number of a name, a new one if it has none.
    pub fn number_of(&mut self, name: &str) -> usize {
        if let Some(number) = self.numbers.get(name) {
            return *number;
        }
        let number = self.names.len();
        self.numbers.insert(name.to_owned(), number);
        self.names.push(name.to_owned());
        number
    }

    /// The name of a number.
    ///
    /// # Panics
    /// If no name has it.
    pub fn name(&self, number: usize) -> &str {
        &self.names[number]
    }

    /// All names in the order of their numbers.
    pub fn into_names(self) -> Vec<String> {
        self.names
    }
}
