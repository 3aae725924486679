//! `--set key=value`: changes to an experiment file from the command line.
//!
//! Keys are dotted paths, such as `runs`, `budget.spp` or `estimator.bpt.max_length`; entries of `[[scene]]` and
//! `[[estimator]]` go by their name, or by number from 0. Values are TOML; what is not is taken for a text.

use crate::error::{Error, Result, did_you_mean, nearest};
use toml::{Table, Value};

/// Keys of which a table may hold only one: setting one takes the others out.
const EXCLUSIVE: [&[&str]; 2] = [&["spp", "seconds"], &["file", "preset", "techniques"]];

/// One `key=value`.
#[derive(Clone, Debug, PartialEq)]
pub struct Override {
    key: Vec<String>,
    value: Value,
    text: String,
}

impl Override {
    /// Reads `key=value`.
    ///
    /// # Errors
    /// Without an `=`, or with an empty part in the key.
    pub fn parse(text: &str) -> Result<Self> {
        let wrong = || Error::usage(format!("--set {text}: expected key=value, as in --set budget.spp=16"));
        let (key, value) = text.split_once('=').ok_or_else(wrong)?;
        let key: Vec<String> = key.trim().split('.').map(str::to_owned).collect();
        if key.iter().any(|part| part.is_empty() || part.contains(char::is_whitespace)) {
            return Err(wrong());
        }
        Ok(Self { key, value: parse_value(value.trim()), text: text.to_owned() })
    }

    /// As it was given.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Makes the change.
    ///
    /// # Errors
    /// A key that leads through something that is not a table, or to an entry that is not there.
    pub fn apply(&self, table: &mut Table) -> Result<()> {
        let fail = |message: String| Error::usage(format!("--set {}: {message}", self.text));
        let (last, path) = self.key.split_last().expect("keys have at least one part");
        let mut at = Node::Table(table);
        for part in path {
            at = at.child(part).map_err(fail)?;
        }
        match at {
            Node::Table(table) => {
                for others in EXCLUSIVE.iter().filter(|keys| keys.contains(&last.as_str())) {
                    table.retain(|key, _| key == last || !others.contains(&key));
                }
                table.insert(last.clone(), self.value.clone());
            }
            Node::Array(array) => {
                let index = entry(array, last).map_err(fail)?;
                array[index] = self.value.clone();
            }
        }
        Ok(())
    }
}

/// A TOML value, or the text itself.
fn parse_value(text: &str) -> Value {
    let parsed = toml::from_str::<Table>(&format!("value = {text}")).ok();
    // A line break could smuggle in more keys; such a text is a text.
    let alone = parsed.filter(|table| table.len() == 1).and_then(|mut table| table.remove("value"));
    alone.unwrap_or_else(|| Value::String(text.to_owned()))
}

enum Node<'a> {
    Table(&'a mut Table),
    Array(&'a mut Vec<Value>),
}

impl<'a> Node<'a> {
    fn child(self, part: &str) -> Result<Self, String> {
        let value = match self {
            Self::Table(table) => table.entry(part.to_owned()).or_insert_with(|| Value::Table(Table::new())),
            Self::Array(array) => {
                let index = entry(array, part)?;
                &mut array[index]
            }
        };
        match value {
            Value::Table(table) => Ok(Self::Table(table)),
            Value::Array(array) => Ok(Self::Array(array)),
            other => Err(format!("`{part}` is a {}, which has no keys", other.type_str())),
        }
    }
}

/// What an entry of `[[scene]]` or `[[estimator]]` is called.
fn name_of(entry: &Value) -> Option<&str> {
    ["name", "preset", "file"].iter().find_map(|key| entry.get(key)?.as_str())
}

/// Position of the entry with that name or number.
fn entry(array: &[Value], part: &str) -> Result<usize, String> {
    let names: Vec<&str> = array.iter().filter_map(name_of).collect();
    if let Some(index) = array.iter().position(|e| name_of(e) == Some(part)) {
        return Ok(index);
    }
    if let Some(index) = part.parse().ok().filter(|index| *index < array.len()) {
        return Ok(index);
    }
    let hint = did_you_mean(nearest(part, names.iter().copied()));
    Err(format!("there is no entry `{part}`: there are {} ({}){hint}", array.len(), names.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn set(file: &str, change: &str) -> Result<Table> {
        let mut table: Table = toml::from_str(file).unwrap();
        Override::parse(change)?.apply(&mut table)?;
        Ok(table)
    }

    const FILE: &str =
        "runs = 3\nbudget = { spp = 8 }\n[[estimator]]\npreset = \"pt\"\n[[estimator]]\nname = \"b\"\n";

    #[test]
    fn values_are_toml_or_texts() {
        let cases = [
            ("2", Value::Integer(2)),
            ("2.5", Value::Float(2.5)),
            ("true", Value::Boolean(true)),
            ("\"2\"", Value::String("2".into())),
            ("all", Value::String("all".into())),
            ("2\nother = 3", Value::String("2\nother = 3".into())),
        ];
        for (text, value) in cases {
            assert_eq!(set(FILE, &format!("runs={text}")).unwrap()["runs"], value);
        }
        assert_eq!(set(FILE, "size=[4, 5]").unwrap()["size"].as_array().unwrap().len(), 2);
    }

    #[test]
    fn dotted_keys_reach_entries_by_name_and_number() {
        for key in ["estimator.pt", "estimator.0"] {
            let table = set(FILE, &format!("{key}.max_length=3")).unwrap();
            assert_eq!(table["estimator"][0]["max_length"].as_integer(), Some(3));
        }
        assert_eq!(set(FILE, "figures.strip=true").unwrap()["figures"]["strip"].as_bool(), Some(true));
    }

    #[test]
    fn one_of_several_keys_replaces_the_others() {
        let table = set(FILE, "budget.seconds=2").unwrap();
        assert!(table["budget"].get("spp").is_none());
        assert_eq!(table["budget"]["seconds"].as_integer(), Some(2));
    }

    #[test]
    fn what_leads_nowhere_is_refused() {
        for (change, part) in [
            ("runs", "key=value"),
            ("=3", "key=value"),
            ("a..b=3", "key=value"),
            ("runs.x=3", "has no keys"),
            ("estimator.pd.name=x", "did you mean `pt`"),
            ("estimator.7=3", "there are 2"),
        ] {
            let message = set(FILE, change).unwrap_err().to_string();
            assert!(message.contains(part), "{message}");
        }
    }
}
