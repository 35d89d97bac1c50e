//! Why something is not done.

/// Why a request or the server itself is refused; the text is shown on the page.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LiveError {
    /// A value outside its range.
    #[error(transparent)]
    Range(#[from] spts_models::ConfigError),
    /// A name that is not in its table.
    #[error("`{field}` = {name:?}; valid: {known}")]
    Unknown {
        /// Field of the request.
        field: &'static str,
        /// Name that was asked for.
        name: String,
        /// Names that there are.
        known: String,
    },
    /// A message that is none.
    #[error("message: {0}")]
    Message(String),
    /// A mesh that cannot press.
    #[error(transparent)]
    Mesh(#[from] spts_contact::mesh::MeshError),
    /// The readout refuses what is asked of it.
    #[error(transparent)]
    Chain(#[from] spts::ChainError),
    /// The port cannot be used.
    #[error("`--port` = {port}: {source}; `--port 0` takes any free one")]
    Port {
        /// Port that was asked for.
        port: u16,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// The server ended.
    #[error("the server ended: {0}")]
    Server(std::io::Error),
}
