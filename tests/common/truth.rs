//! Tables of known answers: deterministic quadrature and closed forms, made independently of this program. Each value
//! has an estimate of its absolute error.

use serde_json::Value;

/// One row of a table.
pub struct Row {
    pub id: String,
    value: Value,
}

/// Whether all rows are tested, with as many samples as it takes, or the core rows with fewer.
pub fn full() -> bool {
    std::env::var_os("TYNDALL_FULL").is_some_and(|value| !value.is_empty())
}

/// The rows of a table that this run tests. `TYNDALL_ROWS` picks those whose name begins with it, to look at a few of them again.
pub fn rows(name: &str) -> Vec<Row> {
    let wanted = picked().unwrap_or_default();
    table(name).into_iter().filter(|row| (full() || row.core()) && row.id.starts_with(&wanted)).collect()
}

/// What the names of the rows to be tested begin with, where somebody picks them.
pub fn picked() -> Option<String> {
    std::env::var("TYNDALL_ROWS").ok()
}

/// Whether nothing of the rows is left out to save time.
pub fn whole() -> bool {
    full() || picked().is_some()
}

/// The bias worth catching: a hundredth of what is expected, but no less than a thousandth.
pub fn tolerance(expected: f64) -> f64 {
    (1e-2 * expected).max(1e-3)
}

/// The cosines of table A2 that this run tests, with their places in the table's lists: all, or one steep and one flat.
pub fn cosines_of_check() -> impl Iterator<Item = (usize, f64)> {
    let (first, step) = if whole() { (0, 1) } else { (1, 3) };
    [1.0, 0.9, 0.7, 0.5, 0.3, 0.1].into_iter().enumerate().skip(first).step_by(step)
}

/// The rows of `tests/truth/{name}.json`.
pub fn table(name: &str) -> Vec<Row> {
    let path = format!("{}/tests/truth/{name}.json", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{path}: {error}"));
    let whole: Value = serde_json::from_str(&text).unwrap_or_else(|error| panic!("{path}: {error}"));
    let rows = whole["rows"].as_array().expect("a table has rows");
    rows.iter()
        .map(|row| Row { id: row["id"].as_str().expect("a row has an id").to_owned(), value: row.clone() })
        .collect()
}

impl Row {
    /// A number of the input.
    pub fn number(&self, name: &str) -> f64 {
        self.value["in"][name].as_f64().unwrap_or_else(|| panic!("{}: no {name}", self.id))
    }

    /// A number of the input, or nothing where it is another kind of value.
    pub fn maybe_number(&self, name: &str) -> Option<f64> {
        self.value["in"][name].as_f64()
    }

    /// A word of the input; empty where there is none.
    pub fn word(&self, name: &str) -> &str {
        self.value["in"][name].as_str().unwrap_or_default()
    }

    /// Three numbers of the input.
    pub fn vector(&self, name: &str) -> glam::DVec3 {
        glam::DVec3::from_slice(&self.list(name))
    }

    /// The input as it is.
    pub fn input(&self) -> &Value {
        &self.value["in"]
    }

    /// Whether the row belongs to the few of every check.
    pub fn core(&self) -> bool {
        self.value["tier"] == "core"
    }

    /// Whether there is such an output.
    pub fn has(&self, name: &str) -> bool {
        !self.value["out"][name].is_null()
    }

    /// A single value of the output and its absolute error.
    pub fn value(&self, name: &str) -> (f64, f64) {
        let (values, error) = self.output(name);
        (values[0], error)
    }

    /// A list of the input.
    pub fn list(&self, name: &str) -> Vec<f64> {
        numbers(&self.value["in"][name]).unwrap_or_else(|| panic!("{}: no {name}", self.id))
    }

    /// Values of the output and their absolute error.
    pub fn output(&self, name: &str) -> (Vec<f64>, f64) {
        let entry = &self.value["out"][name];
        let error = entry[1].as_f64().unwrap_or_else(|| panic!("{}: no {name}", self.id));
        (numbers(&entry[0]).unwrap_or_else(|| panic!("{}: no {name}", self.id)), error)
    }
}

fn numbers(value: &Value) -> Option<Vec<f64>> {
    match value.as_array() {
        Some(list) => list.iter().map(Value::as_f64).collect(),
        None => Some(vec![value.as_f64()?]),
    }
}
