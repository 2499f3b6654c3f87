//! JSON as far as `vehicle.json` needs it: read into values, which are asked for by key and kind.
use std::collections::HashMap;

/// A value of JSON.
#[derive(Clone, Debug, PartialEq)]
pub enum Json {
    Null,
    Bool(bool),
    Number(f64),
    Text(String),
    List(Vec<Json>),
    Object(HashMap<String, Json>),
}

/// A deeper file is refused: each level is a call of the reader.
const DEEPEST: usize = 64;

impl Json {
    /// Read a text, all of it.
    pub fn read(text: &str) -> Result<Json, String> {
        let mut reader = Reader { bytes: text.as_bytes(), at: 0, depth: 0 };
        let value = reader.value()?;
        reader.space();
        if reader.at == text.len() { Ok(value) } else { Err(reader.error("ends too late")) }
    }

    /// The value of a key.
    pub fn get(&self, key: &str) -> Result<&Json, String> {
        match self {
            Json::Object(entries) => entries.get(key).ok_or_else(|| format!("no key {key:?}")),
            _ => Err(format!("no object that has {key:?}")),
        }
    }

    pub fn number(&self) -> Result<f64, String> {
        match self {
            Json::Number(x) => Ok(*x),
            other => Err(format!("no number: {other:?}")),
        }
    }

    /// A number without decimals that counts.
    pub fn count(&self) -> Result<usize, String> {
        let x = self.number()?;
        if x >= 0.0 && x.fract() == 0.0 && x < 1e9 { Ok(x as usize) } else { Err(format!("no count: {x}")) }
    }

    pub fn is_true(&self) -> Result<bool, String> {
        match self {
            Json::Bool(is_true) => Ok(*is_true),
            other => Err(format!("neither true nor false: {other:?}")),
        }
    }

    pub fn text(&self) -> Result<String, String> {
        match self {
            Json::Text(text) => Ok(text.clone()),
            other => Err(format!("no text: {other:?}")),
        }
    }

    pub fn items(&self) -> Result<&[Json], String> {
        match self {
            Json::List(items) => Ok(items),
            other => Err(format!("no list: {other:?}")),
        }
    }

    /// So many items.
    pub fn tuple<const N: usize>(&self) -> Result<&[Json; N], String> {
        let items = self.items()?;
        items.try_into().map_err(|_| format!("{} items, {N} expected", items.len()))
    }

    /// Every item of a list, read in one way.
    pub fn list<T>(&self, read: impl Fn(&Json) -> Result<T, String>) -> Result<Vec<T>, String> {
        self.items()?.iter().map(read).collect()
    }

    /// None for null.
    pub fn optional<T>(&self, read: impl Fn(&Json) -> Result<T, String>) -> Result<Option<T>, String> {
        if *self == Json::Null { Ok(None) } else { read(self).map(Some) }
    }
}

struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
    depth: usize,
}

impl Reader<'_> {
    fn error(&self, what: &str) -> String {
        format!("JSON {what} at byte {}", self.at)
    }

    fn space(&mut self) {
        while self.bytes.get(self.at).is_some_and(u8::is_ascii_whitespace) {
            self.at += 1;
        }
    }

    /// The next byte that is no space.
    fn peek(&mut self) -> Result<u8, String> {
        self.space();
        self.bytes.get(self.at).copied().ok_or_else(|| self.error("ends too early"))
    }

    fn take(&mut self, expected: u8) -> Result<(), String> {
        if self.peek()? != expected {
            return Err(self.error(&format!("lacks {:?}", expected as char)));
        }
        self.at += 1;
        Ok(())
    }

    fn value(&mut self) -> Result<Json, String> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(self.error("is nested too deeply"));
        }
        let value = match self.peek()? {
            b'{' => self.object(),
            b'[' => self.list(),
            b'"' => self.text().map(Json::Text),
            b't' => self.word("true", Json::Bool(true)),
            b'f' => self.word("false", Json::Bool(false)),
            b'n' => self.word("null", Json::Null),
            _ => self.number(),
        };
        self.depth -= 1;
        value
    }

    fn word(&mut self, word: &str, value: Json) -> Result<Json, String> {
        if !self.bytes[self.at..].starts_with(word.as_bytes()) {
            return Err(self.error("has an unknown word"));
        }
        self.at += word.len();
        Ok(value)
    }

    fn number(&mut self) -> Result<Json, String> {
        let is_part = |b: &u8| b.is_ascii_digit() || b"+-.eE".contains(b);
        let length = self.bytes[self.at..].iter().take_while(|b| is_part(b)).count();
        let text = std::str::from_utf8(&self.bytes[self.at..self.at + length]).unwrap_or_default();
        let number = text.parse().map_err(|_| self.error("has no value"))?;
        self.at += length;
        Ok(Json::Number(number))
    }

    fn text(&mut self) -> Result<String, String> {
        self.take(b'"')?;
        let mut found = Vec::new();
        loop {
            let byte = *self.bytes.get(self.at).ok_or_else(|| self.error("ends in a text"))?;
            self.at += 1;
            match byte {
                b'"' => return String::from_utf8(found).map_err(|_| self.error("is no UTF-8")),
                b'\\' => self.escape(&mut found)?,
                _ => found.push(byte),
            }
        }
    }

    /// What follows a backslash; halves of a character beyond the basic plane become the replacement character.
    fn escape(&mut self, to: &mut Vec<u8>) -> Result<(), String> {
        let byte = *self.bytes.get(self.at).ok_or_else(|| self.error("ends in a text"))?;
        self.at += 1;
        let plain = match byte {
            b'"' | b'\\' | b'/' => byte as char,
            b'n' => '\n',
            b't' => '\t',
            b'r' => '\r',
            b'b' => '\u{8}',
            b'f' => '\u{c}',
            b'u' => {
                let digits = self.bytes.get(self.at..self.at + 4).and_then(|d| std::str::from_utf8(d).ok());
                let code = digits.and_then(|d| u32::from_str_radix(d, 16).ok());
                let code = code.ok_or_else(|| self.error("has a wrong escape"))?;
                self.at += 4;
                char::from_u32(code).unwrap_or(char::REPLACEMENT_CHARACTER)
            }
            _ => return Err(self.error("has a wrong escape")),
        };
        to.extend(plain.encode_utf8(&mut [0; 4]).as_bytes());
        Ok(())
    }

    fn list(&mut self) -> Result<Json, String> {
        self.take(b'[')?;
        let mut items = Vec::new();
        while self.peek()? != b']' {
            if !items.is_empty() {
                self.take(b',')?;
            }
            items.push(self.value()?);
        }
        self.take(b']')?;
        Ok(Json::List(items))
    }

    fn object(&mut self) -> Result<Json, String> {
        self.take(b'{')?;
        let mut entries = HashMap::new();
        while self.peek()? != b'}' {
            if !entries.is_empty() {
                self.take(b',')?;
            }
            self.space();
            let key = self.text()?;
            self.take(b':')?;
            entries.insert(key, self.value()?);
        }
        self.take(b'}')?;
        Ok(Json::Object(entries))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_of_every_kind_are_read() {
        let read = Json::read(r#" {"a": [1, -2.5e-3, true, null], "b\n\u00e9": {"c": "d"}} "#).unwrap();
        let [one, small, yes, none] = read.get("a").unwrap().tuple().unwrap();
        assert_eq!((one.count(), small.number(), yes.is_true()), (Ok(1), Ok(-2.5e-3), Ok(true)));
        assert_eq!(none.optional(Json::number), Ok(None));
        assert_eq!(read.get("b\né").unwrap().get("c").unwrap().text(), Ok("d".into()));
    }

    #[test]
    fn faulty_texts_are_errors() {
        for text in ["", "[1", "[1,]", "{\"a\" 1}", "tru", "1 2", "\"\\x\"", "\"a", "--1", &"[".repeat(100)] {
            assert!(Json::read(text).is_err(), "{text}");
        }
    }

    #[test]
    fn numbers_keep_all_their_digits() {
        for x in [0.1, 1.0 / 3.0, 6.02214076e23, 5e-324] {
            assert_eq!(Json::read(&format!("{x:?}")).unwrap(), Json::Number(x));
        }
    }
}
