//! Connections of the server: a limited number of them, each with a limited time for a request.

use axum::serve::Listener;
use std::io;
use std::net::SocketAddr;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::time::{Instant, Sleep, sleep};

/// Most connections at a time; a page needs a few while it loads. Others wait until one ends.
const MOST: usize = 64;
/// Time for a whole request, from the connection or the answer before it on.
const PATIENCE: Duration = Duration::from_secs(20);
/// How the answer begins after which a connection is a page's, which may be quiet for as long as it likes.
const PAGE: &[u8] = b"HTTP/1.1 101";

/// Takes up connections.
pub(crate) struct Connections {
    listener: TcpListener,
    places: Arc<Semaphore>,
    patience: Duration,
}

impl Connections {
    pub(crate) fn new(listener: TcpListener) -> Self {
        Self { listener, places: Arc::new(Semaphore::new(MOST)), patience: PATIENCE }
    }
}

impl Listener for Connections {
    type Io = Connection;
    type Addr = SocketAddr;

    async fn accept(&mut self) -> (Connection, SocketAddr) {
        // a semaphore that nobody closes gives a place
        let place = Arc::clone(&self.places).acquire_owned().await.ok();
        let (stream, address) = Listener::accept(&mut self.listener).await;
        // an update is sent at once, and does not wait for the page to take the one before
        let _ = stream.set_nodelay(true);
        let patience = self.patience;
        (Connection { stream, end: Some(Box::pin(sleep(patience))), patience, _place: place }, address)
    }

    fn local_addr(&self) -> io::Result<SocketAddr> {
        self.listener.local_addr()
    }
}

/// A connection, which ends when a request takes too long.
pub(crate) struct Connection {
    stream: TcpStream,
    /// When it ends without a request; `None` for a page's.
    end: Option<Pin<Box<Sleep>>>,
    patience: Duration,
    _place: Option<OwnedSemaphorePermit>,
}

impl AsyncRead for Connection {
    fn poll_read(mut self: Pin<&mut Self>, cx: &mut Context<'_>, into: &mut ReadBuf<'_>) -> Poll<io::Result<()>> {
        if self.end.as_mut().is_some_and(|end| end.as_mut().poll(cx).is_ready()) {
            return Poll::Ready(Err(io::ErrorKind::TimedOut.into()));
        }
        Pin::new(&mut self.stream).poll_read(cx, into)
    }
}

impl AsyncWrite for Connection {
    fn poll_write(mut self: Pin<&mut Self>, cx: &mut Context<'_>, bytes: &[u8]) -> Poll<io::Result<usize>> {
        let written = Pin::new(&mut self.stream).poll_write(cx, bytes);
        if written.is_ready() {
            if bytes.starts_with(PAGE) {
                self.end = None;
            }
            let end = Instant::now() + self.patience;
            if let Some(sleep) = &mut self.end {
                sleep.as_mut().reset(end);
            }
        }
        written
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(cx)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(cx)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::Router;
    use axum::routing::get;
    use std::io::{Read as _, Write as _};

    /// What was sent by half, or byte by byte, ends; more connections than there are places are served in their turn.
    #[test]
    fn slow_requests_end_and_others_have_their_turn() {
        let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        listener.set_nonblocking(true).unwrap();
        let address = listener.local_addr().unwrap();
        std::thread::spawn(move || {
            let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
            runtime.block_on(async move {
                let connections = Connections {
                    listener: TcpListener::from_std(listener).unwrap(),
                    places: Arc::new(Semaphore::new(4)),
                    patience: Duration::from_millis(500),
                };
                axum::serve(connections, Router::new().route("/", get(|| async { "here" }))).await
            })
        });
        let half = || {
            let mut stream = std::net::TcpStream::connect(address).unwrap();
            stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
            stream.write_all(b"GET / HTTP/1.1\r\nHost: a\r\n").unwrap();
            stream
        };
        let begun = std::time::Instant::now();
        let slow: Vec<_> = (0..12).map(|_| half()).collect();
        let mut whole = half();
        whole.write_all(b"Connection: close\r\n\r\n").unwrap();
        let mut answer = String::new();
        whole.read_to_string(&mut answer).unwrap();
        assert!(answer.ends_with("here"), "{answer}");
        for mut stream in slow {
            // the server has ended it
            let _ = stream.read_to_string(&mut answer);
        }
        // three times four slow ones
        assert!((1.4..30.0).contains(&begun.elapsed().as_secs_f64()), "{:?}", begun.elapsed());
    }
}
