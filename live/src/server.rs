//! The server: one static page, and a WebSocket for everything that moves.

use crate::connection::serve;
use crate::error::LiveError;
use crate::mesh::MOST_MESH_BYTES;
use crate::object::LiveObject;
use crate::origin::own_pages_only;
use crate::shelf::Shelf;
use axum::Router;
use axum::extract::State;
use axum::extract::ws::WebSocketUpgrade;
use axum::http::{StatusCode, header};
use axum::middleware::from_fn_with_state;
use axum::response::{IntoResponse as _, Response};
use axum::routing::{any, get};
use axum::serve::ListenerExt as _;
use std::net::{Ipv4Addr, SocketAddr, TcpListener};
use std::sync::Arc;
use tokio::sync::Semaphore;

/// Most pages at a time.
const MOST_PAGES: usize = 8;

/// Files of the page: path, type, text.
const FILES: [(&str, &str, &str); 6] = [
    ("/", "text/html; charset=utf-8", include_str!("../page/index.html")),
    ("/live.css", "text/css; charset=utf-8", include_str!("../page/live.css")),
    ("/live.js", SCRIPT, include_str!("../page/live.js")),
    ("/draw.js", SCRIPT, include_str!("../page/draw.js")),
    ("/pad.js", SCRIPT, include_str!("../page/pad.js")),
    ("/icon.svg", "image/svg+xml", include_str!("../page/icon.svg")),
];
const SCRIPT: &str = "text/javascript; charset=utf-8";

/// What the server begins with.
#[derive(Debug, Clone)]
pub struct LiveConfig {
    /// Port on 127.0.0.1; 0 for any free one.
    pub port: u16,
    /// Which specimen of the skin it is, and its noise.
    pub seed: u64,
    /// Name of the object that a page begins with.
    pub object: String,
}

/// What all pages share.
pub(crate) struct Shared {
    pub(crate) shelf: Arc<Shelf>,
    pub(crate) seed: u64,
    pub(crate) object: String,
    pub(crate) pages: Arc<Semaphore>,
    /// One mesh is read at a time.
    pub(crate) meshes: Arc<Semaphore>,
}

/// A server that listens.
pub struct Server {
    listener: TcpListener,
    address: SocketAddr,
    shared: Arc<Shared>,
}

impl Server {
    /// Listens on 127.0.0.1.
    ///
    /// # Errors
    /// [`LiveError::Unknown`] for an object that is not there, [`LiveError::Port`] for a port that is taken.
    pub fn bind(config: &LiveConfig) -> Result<Self, LiveError> {
        LiveObject::named(&config.object)?;
        let refused = |source| LiveError::Port {
            port: config.port,
            source,
        };
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, config.port)).map_err(refused)?;
        listener.set_nonblocking(true).map_err(refused)?;
        Ok(Self {
            address: listener.local_addr().map_err(refused)?,
            listener,
            shared: Arc::new(Shared {
                shelf: Arc::new(Shelf::new()),
                seed: config.seed,
                object: config.object.clone(),
                pages: Arc::new(Semaphore::new(MOST_PAGES)),
                meshes: Arc::new(Semaphore::new(1)),
            }),
        })
    }

    /// Where it listens.
    #[must_use]
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Serves until the program ends.
    ///
    /// # Errors
    /// [`LiveError::Server`] when the operating system does not let it go on.
    pub fn run(self) -> Result<(), LiveError> {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
        let runtime = runtime.map_err(LiveError::Server)?;
        let mut router = Router::new().route("/socket", any(socket));
        for (path, kind, text) in FILES {
            router = router.route(path, get(move || async move { ([(header::CONTENT_TYPE, kind)], text) }));
        }
        let router = router
            .with_state(self.shared)
            .layer(from_fn_with_state(self.address.port(), own_pages_only));
        runtime.block_on(async move {
            let listener = tokio::net::TcpListener::from_std(self.listener).map_err(LiveError::Server)?;
            // an update is sent at once, and does not wait for the page to take the one before
            let listener = listener.tap_io(|stream| drop(stream.set_nodelay(true)));
            axum::serve(listener, router).await.map_err(LiveError::Server)
        })
    }
}

async fn socket(State(shared): State<Arc<Shared>>, upgrade: WebSocketUpgrade) -> Response {
    let Ok(place) = Arc::clone(&shared.pages).try_acquire_owned() else {
        let reason = format!("{MOST_PAGES} pages are open already");
        return (StatusCode::SERVICE_UNAVAILABLE, reason).into_response();
    };
    upgrade
        .max_message_size(MOST_MESH_BYTES)
        .max_frame_size(MOST_MESH_BYTES)
        .on_upgrade(move |socket| async move {
            serve(socket, shared).await;
            drop(place);
        })
}
