//! What a client did wrong, on its way to the client: an error message that ends the session, or
//! one that does not.
//!
//! Fatal is what no client does that keeps to the protocol. Not fatal is what a well-meant request
//! can run into: a key whose planes do not fit, a quota, a stream that has just ended.

use foreframe_protocol::{Error, ErrorCode, ErrorMessage};

use crate::ingest::IngestError;

/// An error message to a client.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Fault(Box<ErrorMessage>);

impl Fault {
    /// A fault that ends the session.
    #[must_use]
    pub fn fatal(
        code: ErrorCode,
        field: &str,
        expected: impl Into<String>,
        found: impl ToString,
    ) -> Self {
        Self(Box::new(ErrorMessage {
            code,
            is_fatal: true,
            stream: None,
            field: field.to_owned(),
            expected: expected.into(),
            found: found.to_string(),
        }))
    }

    /// The same, but the session goes on.
    #[must_use]
    pub fn tolerated(mut self) -> Self {
        self.0.is_fatal = false;
        self
    }

    /// The same, about this stream.
    #[must_use]
    pub fn of_stream(mut self, stream: u32) -> Self {
        self.0.stream = Some(stream).filter(|&stream| stream != 0);
        self
    }

    /// Whether the session ends with it.
    #[must_use]
    pub fn is_fatal(&self) -> bool {
        self.0.is_fatal
    }

    /// The message.
    #[must_use]
    pub fn into_message(self) -> ErrorMessage {
        *self.0
    }
}

impl From<ErrorMessage> for Fault {
    fn from(message: ErrorMessage) -> Self {
        Self(Box::new(message))
    }
}

impl From<Error> for Fault {
    /// Fatal.
    fn from(error: Error) -> Self {
        Self(Box::new(ErrorMessage::new(&error, true, None)))
    }
}

impl From<IngestError> for Fault {
    /// Fatal.
    fn from(error: IngestError) -> Self {
        let code = match error {
            IngestError::ContentTime { .. } | IngestError::KeyIndex { .. } => ErrorCode::Order,
            _ => ErrorCode::Plane,
        };
        let (field, expected, found) = error.parts();
        Self::fatal(code, &field, expected, found)
    }
}
