//! `sensor_msgs/msg/JointState` as ROS 2 writes it: CDR, little or big endian.

use crate::error::LogError;

/// Name of the type in a bag.
pub(crate) const TYPE: &str = "sensor_msgs/msg/JointState";
/// Joints beyond which a message is none.
const MOST_JOINTS: usize = 1000;

/// One message.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct JointState {
    /// Stamp of the header, ns.
    pub stamp: i64,
    pub name: Vec<String>,
    pub position: Vec<f64>,
    pub velocity: Vec<f64>,
    pub effort: Vec<f64>,
}

impl JointState {
    /// Reads the bytes of a message.
    ///
    /// # Errors
    /// What is wrong with them.
    pub fn parse(bytes: &[u8]) -> Result<Self, String> {
        let mut cdr = Cdr::new(bytes)?;
        let seconds = i64::from(i32::from_ne_bytes(cdr.u32()?.to_ne_bytes()));
        let nanoseconds = i64::from(cdr.u32()?);
        cdr.text()?;
        let name = (0..cdr.length()?)
            .map(|_| cdr.text())
            .collect::<Result<_, _>>()?;
        Ok(Self {
            stamp: seconds * 1_000_000_000 + nanoseconds,
            name,
            position: cdr.numbers()?,
            velocity: cdr.numbers()?,
            effort: cdr.numbers()?,
        })
    }
}

/// Common Data Representation, version 1: every number at a multiple of its size from the end of the header.
struct Cdr<'a> {
    bytes: &'a [u8],
    at: usize,
    is_little: bool,
}

impl<'a> Cdr<'a> {
    fn new(bytes: &'a [u8]) -> Result<Self, String> {
        match bytes {
            [0, order @ (0 | 1), _, _, rest @ ..] => Ok(Self {
                bytes: rest,
                at: 0,
                is_little: *order == 1,
            }),
            _ => Err("it does not begin as CDR".to_owned()),
        }
    }

    fn take(&mut self, n: usize) -> Result<&'a [u8], String> {
        let end = self
            .at
            .checked_add(n)
            .filter(|end| *end <= self.bytes.len());
        let end = end.ok_or_else(|| format!("it ends after {} bytes", self.bytes.len()))?;
        let taken = &self.bytes[self.at..end];
        self.at = end;
        Ok(taken)
    }

    fn u32(&mut self) -> Result<u32, String> {
        self.at = self.at.next_multiple_of(4);
        let mut bytes = [0; 4];
        bytes.copy_from_slice(self.take(4)?);
        let of = if self.is_little {
            u32::from_le_bytes
        } else {
            u32::from_be_bytes
        };
        Ok(of(bytes))
    }

    fn length(&mut self) -> Result<usize, String> {
        let n = self.u32()? as usize;
        if n > MOST_JOINTS {
            return Err(format!("a list of {n} joints"));
        }
        Ok(n)
    }

    fn text(&mut self) -> Result<String, String> {
        let n = self.u32()? as usize;
        let bytes = self.take(n)?;
        let bytes = bytes.strip_suffix(&[0]).unwrap_or(bytes);
        String::from_utf8(bytes.to_vec()).map_err(|_| "a name is not UTF-8".to_owned())
    }

    fn numbers(&mut self) -> Result<Vec<f64>, String> {
        let n = self.length()?;
        if n > 0 {
            self.at = self.at.next_multiple_of(8);
        }
        let (bytes, _) = self.take(8 * n)?.as_chunks::<8>();
        let of = if self.is_little {
            f64::from_le_bytes
        } else {
            f64::from_be_bytes
        };
        Ok(bytes.iter().map(|bytes| of(*bytes)).collect())
    }
}

/// Which joints of messages are wanted, by their places.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct JointOrder {
    names: Vec<String>,
    /// Of the wanted joints in a message.
    pub places: Vec<usize>,
}

impl JointOrder {
    /// Of the joints asked for, or of all; a joint without effort is none to learn from.
    pub fn new(file: &str, first: &JointState, asked: &[String]) -> Result<Self, LogError> {
        let n = first.name.len();
        for (what, found) in [
            ("positions", first.position.len()),
            ("efforts", first.effort.len()),
        ] {
            if found != n || n == 0 {
                return Err(LogError::file(
                    file,
                    format!("message 1: {found} {what} of {n} joints"),
                ));
            }
        }
        let place = |joint: &String| {
            first
                .name
                .iter()
                .position(|name| name == joint)
                .ok_or_else(|| {
                    LogError::file(
                        file,
                        format!("no joint `{joint}`; there are {}", first.name.join(", ")),
                    )
                })
        };
        let places = match asked {
            [] => (0..n).collect(),
            _ => asked.iter().map(place).collect::<Result<_, _>>()?,
        };
        Ok(Self {
            names: first.name.clone(),
            places,
        })
    }

    /// Of no joint.
    pub fn empty() -> Self {
        Self {
            names: Vec::new(),
            places: Vec::new(),
        }
    }

    /// Names of the wanted joints.
    pub fn joints(&self) -> Vec<String> {
        self.places
            .iter()
            .map(|place| self.names[*place].clone())
            .collect()
    }

    /// Checks that a message is of the same joints in the same order.
    pub fn check(&self, message: &JointState, has_velocity: bool) -> Result<(), String> {
        if message.name != self.names {
            return Err(format!(
                "its joints are {}, those of the first message {}",
                message.name.join(", "),
                self.names.join(", ")
            ));
        }
        let n = self.names.len();
        let is_short = message.position.len() != n
            || message.effort.len() != n
            || has_velocity && message.velocity.len() != n;
        if is_short {
            return Err(format!(
                "{} positions, {} speeds and {} efforts of {n} joints",
                message.position.len(),
                message.velocity.len(),
                message.effort.len()
            ));
        }
        Ok(())
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// The bytes of a message, little endian.
    pub(crate) fn bytes_of(message: &JointState) -> Vec<u8> {
        let mut bytes: Vec<u8> = Vec::new();
        let pad =
            |bytes: &mut Vec<u8>, size: usize| bytes.resize(bytes.len().next_multiple_of(size), 0);
        let put = |bytes: &mut Vec<u8>, n: usize| {
            pad(bytes, 4);
            bytes.extend(u32::try_from(n).unwrap().to_le_bytes());
        };
        put(
            &mut bytes,
            usize::try_from(message.stamp / 1_000_000_000).unwrap(),
        );
        put(
            &mut bytes,
            usize::try_from(message.stamp % 1_000_000_000).unwrap(),
        );
        let text = |bytes: &mut Vec<u8>, text: &str| {
            put(bytes, text.len() + 1);
            bytes.extend(text.as_bytes());
            bytes.push(0);
        };
        text(&mut bytes, "");
        put(&mut bytes, message.name.len());
        message.name.iter().for_each(|name| text(&mut bytes, name));
        for numbers in [&message.position, &message.velocity, &message.effort] {
            put(&mut bytes, numbers.len());
            if !numbers.is_empty() {
                pad(&mut bytes, 8);
            }
            bytes.extend(numbers.iter().flat_map(|x| x.to_le_bytes()));
        }
        [&[0, 1, 0, 0], &bytes[..]].concat()
    }

    fn message() -> JointState {
        JointState {
            stamp: 1_700_000_000_123_456_789,
            name: vec!["elbow".to_owned(), "wrist_1".to_owned()],
            position: vec![0.5, -0.25],
            velocity: vec![],
            effort: vec![3.0, 4.0],
        }
    }

    #[test]
    fn a_message_is_read_and_one_that_is_cut_is_not() {
        let bytes = bytes_of(&message());
        assert_eq!(JointState::parse(&bytes), Ok(message()));
        for end in 0..bytes.len() {
            assert!(JointState::parse(&bytes[..end]).is_err(), "{end}");
        }
    }

    #[test]
    fn other_joints_or_another_order_are_refused() {
        let order = JointOrder::new("a.db3", &message(), &["wrist_1".to_owned()]).unwrap();
        assert_eq!(
            (order.joints(), &order.places[..]),
            (vec!["wrist_1".to_owned()], &[1][..])
        );
        assert_eq!(order.check(&message(), false), Ok(()));
        assert!(order.check(&message(), true).is_err());
        let mut other = message();
        other.name.reverse();
        assert!(
            order
                .check(&other, false)
                .unwrap_err()
                .contains("wrist_1, elbow")
        );
        assert!(JointOrder::new("a.db3", &message(), &["hip".to_owned()]).is_err());
    }
}
