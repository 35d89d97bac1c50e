//! The server: pages that it served itself, each with a session of its own.
//!
//! A name that a foreign page has resolve to this server (DNS rebinding) stands in `Host`, and the page that a browser
//! sends a request for stands in `Origin`. Without a token, both have to be 127.0.0.1 with the server's port. With one,
//! as in a container or behind another port, `Host` may be any name, `Origin` has to be the same one, and the browser
//! has to know the token: from the address at first, then from a cookie, which pages of other sites do not send.

use crate::UPDATE_S;
use crate::connections::Connections;
use crate::object::{LiveObject, MOST_MESH_BYTES, MeshUnit, UploadedMesh};
use crate::session::{Frame, LiveSession, Request, message};
use crate::wires::Shelf;
use axum::Router;
use axum::body::{Body, Bytes};
use axum::extract::ws::{Message, WebSocket, WebSocketUpgrade};
use axum::extract::{Request as HttpRequest, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, header};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse as _, Response};
use axum::routing::{any, get};
use serde::Serialize;
use spts::Refusal;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, TcpListener};
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::sync::Semaphore;
use tokio::sync::mpsc::{Receiver, Sender, channel};

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
    /// Address to listen at. Any but this machine's own (127.0.0.1, ::1) needs a token.
    pub host: IpAddr,
    /// Its port; 0 for any free one.
    pub port: u16,
    /// What a browser has to know, 16 to 128 letters, digits, - and _; `None`: nothing, but it has to be on this
    /// machine and ask for this port.
    pub token: Option<String>,
    /// Which specimen of the skin it is, and its noise.
    pub seed: u64,
    /// Name of the object that a page begins with.
    pub object: String,
}

/// What all pages share.
struct Shared {
    shelf: Arc<Shelf>,
    seed: u64,
    object: String,
    pages: Arc<Semaphore>,
    /// One mesh is read at a time.
    meshes: Arc<Semaphore>,
}

/// A server that listens.
pub struct Server {
    listener: TcpListener,
    address: SocketAddr,
    guard: Guard,
    shared: Arc<Shared>,
}

/// 128 random bits of the operating system, as a token.
///
/// # Errors
/// [`Refusal`] if the system has none.
pub fn token() -> Result<String, Refusal> {
    let mut bytes = [0; 16];
    getrandom::fill(&mut bytes).map_err(|e| Refusal::new(format!("`--token`: no random numbers: {e}")))?;
    Ok(bytes.iter().map(|byte| format!("{byte:02x}")).collect())
}

impl Server {
    /// Listens.
    ///
    /// # Errors
    /// [`Refusal`] for an object that is not there, an address or port that cannot be had, an address of other machines
    /// without a token, or a token of other length or characters.
    pub fn bind(config: &LiveConfig) -> Result<Self, Refusal> {
        LiveObject::named(&config.object)?;
        let LiveConfig { host, port, token, .. } = config;
        let is_valid = |t: &String| {
            (16..=128).contains(&t.len()) && t.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'-' || b == b'_')
        };
        if token.as_ref().is_some_and(|token| !is_valid(token)) {
            return Err(Refusal::new("`--token` is not 16 to 128 letters, digits, - and _"));
        }
        if token.is_none() && !host.is_loopback() {
            return Err(Refusal::new(format!("`--host` = {host} is not of this machine alone; it needs a `--token`")));
        }
        let refused = |e: std::io::Error| {
            let at = SocketAddr::new(*host, *port);
            Refusal::new(format!("`--host` and `--port`, {at}: {e}; `--port 0` takes any free one"))
        };
        let listener = TcpListener::bind((*host, *port)).map_err(refused)?;
        listener.set_nonblocking(true).map_err(refused)?;
        let address = listener.local_addr().map_err(refused)?;
        Ok(Self {
            address,
            guard: Guard { port: address.port(), token: token.clone() },
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
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// What a browser on this machine opens.
    pub fn url(&self) -> String {
        let mut at = self.address;
        if at.ip().is_unspecified() {
            at.set_ip(if at.is_ipv4() { Ipv4Addr::LOCALHOST.into() } else { Ipv6Addr::LOCALHOST.into() });
        }
        self.guard.token.as_ref().map_or_else(|| format!("http://{at}/"), |token| format!("http://{at}/?token={token}"))
    }

    /// Serves until the program ends.
    ///
    /// # Errors
    /// [`Refusal`] when the operating system does not let it go on.
    pub fn run(self) -> Result<(), Refusal> {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
        let runtime = runtime.map_err(ended)?;
        let mut router = Router::new().route("/socket", any(socket));
        for (path, kind, text) in FILES {
            router = router.route(path, get(move || async move { ([(header::CONTENT_TYPE, kind)], text) }));
        }
        let router = router.with_state(self.shared).layer(from_fn_with_state(self.guard, own_pages_only));
        runtime.block_on(async move {
            let listener = tokio::net::TcpListener::from_std(self.listener).map_err(ended)?;
            axum::serve(Connections::new(listener), router).await.map_err(ended)
        })
    }
}

fn ended(error: std::io::Error) -> Refusal {
    Refusal::from_error(error).at("the server ended")
}

async fn socket(State(shared): State<Arc<Shared>>, upgrade: WebSocketUpgrade) -> Response {
    let Ok(place) = Arc::clone(&shared.pages).try_acquire_owned() else {
        let reason = format!("{MOST_PAGES} pages are open already");
        return (StatusCode::SERVICE_UNAVAILABLE, reason).into_response();
    };
    upgrade.max_message_size(MOST_MESH_BYTES).max_frame_size(MOST_MESH_BYTES).on_upgrade(move |socket| async move {
        serve(socket, shared).await;
        drop(place);
    })
}

/// Names under which the server may be asked for, the port aside.
const NAMES: [&str; 3] = ["127.0.0.1", "localhost", "[::1]"];

/// Headers of every answer: nothing of it is loaded from elsewhere, shown in a frame, or kept.
const SAFE: [(HeaderName, &str); 6] = [
    (
        header::CONTENT_SECURITY_POLICY,
        "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' data:; \
         base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    ),
    (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (header::X_FRAME_OPTIONS, "DENY"),
    (header::REFERRER_POLICY, "no-referrer"),
    (header::CACHE_CONTROL, "no-store"),
    (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
];

/// Who is let in.
#[derive(Debug, Clone)]
struct Guard {
    port: u16,
    token: Option<String>,
}

/// Lets requests through that come from the server's own page and from those who may see it; an upgrade to a WebSocket
/// has to say where it comes from.
async fn own_pages_only(State(guard): State<Guard>, request: HttpRequest<Body>, next: Next) -> Response {
    let authority = request.uri().authority().map(|a| a.as_str());
    let mut response = match guard.refusal(request.headers(), request.uri().query(), authority) {
        None => next.run(request).await,
        Some(reason) => (StatusCode::FORBIDDEN, format!("{reason}\n")).into_response(),
    };
    for (name, value) in SAFE {
        response.headers_mut().insert(name, HeaderValue::from_static(value));
    }
    if response.status().is_success()
        && let Some(cookie) = guard.cookie()
        && let Ok(value) = HeaderValue::from_str(&format!("{cookie}; HttpOnly; SameSite=Strict; Path=/"))
    {
        response.headers_mut().insert(header::SET_COOKIE, value);
    }
    response
}

impl Guard {
    /// Name and value of the cookie of those who know the token. Servers on one host have names of their own.
    fn cookie(&self) -> Option<String> {
        self.token.as_ref().map(|token| format!("spts_live_{}={token}", self.port))
    }

    /// Why a request is refused.
    fn refusal(&self, headers: &HeaderMap, query: Option<&str>, authority: Option<&str>) -> Option<String> {
        let all = |name| headers.get_all(name).iter().map(|v| v.to_str().ok()).collect::<Vec<Option<&str>>>();
        let (hosts, origins) = (all(header::HOST), all(header::ORIGIN));
        let [Some(host)] = hosts.as_slice() else {
            return Some("The header Host is missing, or there are several.".to_owned());
        };
        if let Some(cookie) = self.cookie() {
            let given =
                query.into_iter().flat_map(|query| query.split('&')).filter_map(|part| part.strip_prefix("token="));
            let known =
                all(header::COOKIE).into_iter().flatten().flat_map(|line| line.split("; ")).any(|c| same(c, &cookie));
            if !known && !given.into_iter().any(|given| self.token.as_ref().is_some_and(|token| same(given, token))) {
                return Some("Open the address that `spts live` has printed: it has the token.".to_owned());
            }
        } else if !is_own(host, self.port) || authority.is_some_and(|authority| !is_own(authority, self.port)) {
            return Some(format!(
                "This server answers at http://127.0.0.1:{}/ alone: the header Host is another one. For other ports and \
                 machines: `spts live --token`.",
                self.port
            ));
        }
        let is_same = |origin: &str| {
            let of = |scheme| origin.strip_prefix(scheme);
            match self.token {
                Some(_) => of("http://").or_else(|| of("https://")).is_some_and(|from| from.eq_ignore_ascii_case(host)),
                None => of("http://").is_some_and(|from| is_own(from, self.port)),
            }
        };
        let own_origin = match origins.as_slice() {
            [] => !headers.contains_key(header::UPGRADE),
            [Some(origin)] => is_same(origin),
            _ => false,
        };
        (!own_origin).then(|| {
            "This server speaks with its own page alone: the header Origin is missing or another one.".to_owned()
        })
    }
}

/// Whether two texts are the same, in a time that tells nothing of where they differ.
fn same(a: &str, b: &str) -> bool {
    a.len() == b.len() && a.bytes().zip(b.bytes()).fold(0, |differ, (a, b)| differ | (a ^ b)) == 0
}

fn is_own(host: &str, port: u16) -> bool {
    // a browser leaves out port 80
    let (name, asked) = match host.rsplit_once(':') {
        Some((name, digits)) if !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit()) => {
            (name, digits.parse::<u16>().ok())
        }
        _ => (host, Some(80)),
    };
    asked == Some(port) && NAMES.iter().any(|known| known.eq_ignore_ascii_case(name))
}

/// Requests that wait for the next update; a page that sends more has to wait.
const WAITING: usize = 256;
/// Messages to the page that wait to be sent; updates beyond them are left out.
const UNSENT: usize = 4;
/// Time in which a page has to take a message.
const PATIENCE: Duration = Duration::from_secs(20);

/// What a session is told.
enum Told {
    Request(Request),
    Mesh(Result<Box<UploadedMesh>, Refusal>),
    Refused(Refusal),
}

/// What a page is told beside frames and shapes.
#[derive(Serialize)]
#[serde(tag = "type", rename_all = "snake_case")]
enum Note<'a> {
    /// Something that was refused.
    Error { text: &'a str },
    /// A mesh that presses from now on.
    Mesh { name: &'a str, notes: &'a [String] },
}

fn nameless() -> Refusal {
    message("bytes without a name")
}

/// Serves one page until it is closed.
async fn serve(mut socket: WebSocket, shared: Arc<Shared>) {
    let (told, requests) = channel(WAITING);
    let (shown, mut messages) = channel(UNSENT);
    let ours = Arc::clone(&shared);
    let thread = std::thread::Builder::new().name("session".to_owned());
    if thread.spawn(move || run(&ours, requests, &shown)).is_err() {
        return;
    }
    let mut announced = None;
    loop {
        tokio::select! {
            message = messages.recv() => {
                let Some(text) = message else { return };
                let sent = tokio::time::timeout(PATIENCE, socket.send(Message::text(text))).await;
                if !matches!(sent, Ok(Ok(()))) {
                    return;
                }
            }
            message = socket.recv() => {
                let told_now = match message {
                    None | Some(Err(_) | Ok(Message::Close(_))) => return,
                    Some(Ok(Message::Text(text))) => match Request::from_json(&text) {
                        Ok(Request::Mesh { name, unit }) => {
                            announced = Some((name, unit));
                            continue;
                        }
                        Ok(request) => Told::Request(request),
                        Err(error) => Told::Refused(error),
                    },
                    Some(Ok(Message::Binary(bytes))) => match announced.take() {
                        Some(announced) => {
                            match read_mesh(&shared, announced, bytes, told.clone()) {
                                Ok(()) => continue,
                                Err(error) => Told::Refused(error),
                            }
                        }
                        None => Told::Refused(nameless()),
                    },
                    Some(Ok(_)) => continue,
                };
                // a session that takes nothing for so long waits for this page to take what it was told
                let taken = tokio::time::timeout(PATIENCE, told.send(told_now)).await;
                if !matches!(taken, Ok(Ok(()))) {
                    return;
                }
            }
        }
    }
}

/// Reads a mesh beside everything else; the session is told of it.
fn read_mesh(
    shared: &Shared,
    (name, unit): (String, MeshUnit),
    bytes: Bytes,
    told: Sender<Told>,
) -> Result<(), Refusal> {
    let Ok(place) = Arc::clone(&shared.meshes).try_acquire_owned() else {
        return Err(message("another mesh is being read; drop it again in a moment".to_owned()));
    };
    tokio::task::spawn_blocking(move || {
        let read = || UploadedMesh::read(&name, unit, &bytes).map(Box::new);
        // the page waits for an answer, whatever became of its mesh
        let mesh = std::panic::catch_unwind(read).unwrap_or_else(|_| Err(message(format!("{name}: cannot be read"))));
        drop((place, bytes));
        // a page that was closed needs none
        let _ = told.blocking_send(Told::Mesh(mesh));
    });
    Ok(())
}

/// The session of a page: an update every [`UPDATE_S`], until the page is gone.
fn run(shared: &Shared, mut requests: Receiver<Told>, shown: &Sender<String>) {
    let begun = LiveSession::new(Arc::clone(&shared.shelf), shared.seed, &shared.object);
    let mut session = match begun {
        Ok(session) => session,
        Err(error) => {
            tell_error(shown, &error);
            return;
        }
    };
    let greeting = tell(shown, &session.options()).and_then(|()| tell(shown, &session.shape()));
    let mut due = Instant::now();
    let mut open = greeting.is_some();
    while open {
        let (told, gone) = take_all(&mut requests);
        open = !gone && obey(&mut session, told, shown).is_some();
        open = open
            && match session.step() {
                Ok(frame) => show(shown, &frame),
                Err(error) => tell_error(shown, &error).is_some(),
            };
        due = (due + Duration::from_secs_f64(UPDATE_S)).max(Instant::now());
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
    }
}

/// What was told since the last update, and whether nothing will be any more.
fn take_all(requests: &mut Receiver<Told>) -> (Vec<Told>, bool) {
    use tokio::sync::mpsc::error::TryRecvError;
    let mut told = Vec::new();
    // no more than fit: a page that never stops does not keep the skin from being updated
    while told.len() < WAITING {
        match requests.try_recv() {
            Ok(one) => told.push(one),
            Err(TryRecvError::Empty) => break,
            Err(TryRecvError::Disconnected) => return (told, true),
        }
    }
    (told, false)
}

/// Does all that was told; of several objects that are chosen the last one alone. Of several refusals the page sees the
/// last one. `None` when the page is gone.
fn obey(session: &mut LiveSession, told: Vec<Told>, shown: &Sender<String>) -> Option<()> {
    let mut refused = None;
    let mut shape = None;
    let is_object = |one: &Told| matches!(one, Told::Request(Request::Object { .. } | Request::Side { .. }));
    let last_object = told.iter().rposition(is_object);
    for (k, one) in told.into_iter().enumerate() {
        // an object that another one follows at once need not be made
        if is_object(&one) && Some(k) != last_object {
            continue;
        }
        let done = match one {
            Told::Refused(error) => Err(error),
            Told::Request(request) => session.apply(request),
            Told::Mesh(Err(error)) => Err(error),
            Told::Mesh(Ok(mesh)) => {
                let note = Note::Mesh { name: &mesh.name, notes: &mesh.notes };
                tell(shown, &note)?;
                Ok(Some(session.press_with(Arc::from(mesh))))
            }
        };
        match done {
            Ok(new) => shape = new.or(shape),
            Err(error) => refused = Some(error),
        }
    }
    shape.map_or(Some(()), |shape| tell(shown, &shape))?;
    refused.map_or(Some(()), |error| tell_error(shown, &error))
}

/// Shows a frame, unless earlier ones are not sent yet. False when the page is gone.
fn show(shown: &Sender<String>, frame: &Frame) -> bool {
    use tokio::sync::mpsc::error::TrySendError;
    // the text is made only where it is sent
    match shown.try_reserve() {
        Ok(place) => {
            place.send(json(frame));
            true
        }
        Err(TrySendError::Full(())) => true,
        Err(TrySendError::Closed(())) => false,
    }
}

/// Sends a message; waits until it can be sent. `None` when the page is gone.
fn tell(shown: &Sender<String>, message: &impl Serialize) -> Option<()> {
    shown.blocking_send(json(message)).ok()
}

fn tell_error(shown: &Sender<String>, error: &Refusal) -> Option<()> {
    tell(shown, &Note::Error { text: &error.to_string() })
}

fn json(message: &impl Serialize) -> String {
    // structures with names of fields have a JSON
    serde_json::to_string(message).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(headers: &[(&str, &str)]) -> bool {
        refused_by(None, "", headers)
    }

    fn refused_by(token: Option<&str>, query: &str, headers: &[(&str, &str)]) -> bool {
        let mut map = HeaderMap::new();
        for (name, value) in headers {
            map.append(HeaderName::from_bytes(name.as_bytes()).unwrap(), value.parse().unwrap());
        }
        let guard = Guard { port: 7117, token: token.map(str::to_owned) };
        guard.refusal(&map, Some(query), None).is_some()
    }

    #[test]
    fn own_hosts_and_origins_alone_are_let_in() {
        let upgrade = ("upgrade", "websocket");
        for host in ["127.0.0.1:7117", "localhost:7117", "LOCALHOST:7117", "[::1]:7117"] {
            let host = ("host", host);
            assert!(!refused(&[host]), "{host:?}");
            assert!(!refused(&[host, upgrade, ("origin", "http://localhost:7117")]), "{host:?}");
            assert!(refused(&[host, upgrade]), "{host:?}");
        }
        for host in [
            "evil.example:7117",
            "127.0.0.1",
            "127.0.0.1:7118",
            "127.0.0.1:071170",
            "127.0.0.1.evil.example:7117",
            "evil@127.0.0.1:7117",
            "localhost.:7117",
            "::1:7117",
            "[::1]",
            "",
        ] {
            assert!(refused(&[("host", host)]), "{host:?}");
        }
        assert!(refused(&[]));
        assert!(refused(&[("host", "127.0.0.1:7117"), ("host", "evil.example")]));
        for origin in [
            "null",
            "http://evil.example",
            "https://127.0.0.1:7117",
            "http://127.0.0.1",
            "http://127.0.0.1:7117.evil.example",
            "http://127.0.0.1:7117/",
            "file://",
        ] {
            assert!(refused(&[("host", "127.0.0.1:7117"), ("origin", origin)]), "{origin:?}");
        }
    }

    #[test]
    fn a_token_lets_in_under_any_name_and_from_its_own_page_alone() {
        let token = "0123456789abcdef";
        let refused = |query: &str, headers: &[(&str, &str)]| refused_by(Some(token), query, headers);
        let (host, knows) = (("host", "robot.lan:8080"), ("cookie", "a=b; spts_live_7117=0123456789abcdef"));
        assert!(!refused("token=0123456789abcdef", &[host]) && !refused("", &[host, knows]));
        assert!(!refused("", &[host, knows, ("upgrade", "websocket"), ("origin", "http://robot.lan:8080")]));
        assert!(!refused("", &[host, knows, ("upgrade", "websocket"), ("origin", "https://robot.lan:8080")]));
        for query in ["", "token=", "token=0123456789abcdeg", "token=0123456789abcdef0", "t=0123456789abcdef"] {
            assert!(refused(query, &[host]), "{query}");
        }
        for cookie in ["", "spts_live_7117=", "spts_live_7118=0123456789abcdef", "xspts_live_7117=0123456789abcdef"] {
            assert!(refused("", &[host, ("cookie", cookie)]), "{cookie}");
        }
        assert!(refused("", &[host, knows, ("upgrade", "websocket")]));
        for origin in
            ["null", "http://evil.example", "http://robot.lan", "http://robot.lan:8080/", "ws://robot.lan:8080"]
        {
            assert!(refused("", &[host, knows, ("origin", origin)]), "{origin}");
        }
        assert!(refused("token=0123456789abcdef", &[]));
    }

    /// A browser that asks for port 80 does not write it.
    #[test]
    fn port_80_need_not_be_written() {
        assert!(is_own("localhost", 80) && !is_own("localhost", 8080) && is_own("[::1]", 80));
    }
}
