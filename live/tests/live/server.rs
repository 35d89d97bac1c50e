//! The server, asked by real clients over TCP.

use spts_live::{LiveConfig, Server};
use std::io::{Read as _, Write as _};
use std::net::{Ipv4Addr, SocketAddr, TcpStream};
use std::time::{Duration, Instant};
use tungstenite::client::IntoClientRequest as _;
use tungstenite::{Message, WebSocket};

/// Time for an answer.
const PATIENCE: Duration = Duration::from_secs(60);

fn server() -> SocketAddr {
    let host = Ipv4Addr::LOCALHOST.into();
    let server = Server::bind(&LiveConfig { host, port: 0, token: None, seed: 1, object: "T".to_owned() });
    let server = server.unwrap();
    let address = server.address();
    std::thread::spawn(move || server.run());
    address
}

fn tcp(address: SocketAddr) -> TcpStream {
    let stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    stream
}

/// The whole answer to a request with these lines of header.
fn answer(address: SocketAddr, path: &str, headers: &[&str]) -> String {
    let mut stream = tcp(address);
    let headers: String = headers.iter().map(|line| format!("{line}\r\n")).collect();
    write!(stream, "GET {path} HTTP/1.1\r\n{headers}Connection: close\r\n\r\n").unwrap();
    let mut text = String::new();
    stream.read_to_string(&mut text).unwrap();
    text
}

fn status(answer: &str) -> u16 {
    answer.split(' ').nth(1).and_then(|code| code.parse().ok()).unwrap_or(0)
}

/// A page's WebSocket, or the status with which it is refused.
fn open(address: SocketAddr, host: &str, origin: Option<&str>) -> Result<WebSocket<TcpStream>, u16> {
    let mut request = format!("ws://{host}/socket").into_client_request().unwrap();
    if let Some(origin) = origin {
        request.headers_mut().insert("origin", origin.parse().unwrap());
    }
    match tungstenite::client(request, tcp(address)) {
        Ok((socket, _)) => Ok(socket),
        Err(tungstenite::HandshakeError::Failure(tungstenite::Error::Http(response))) => {
            Err(response.status().as_u16())
        }
        Err(error) => panic!("{error}"),
    }
}

fn own(address: SocketAddr) -> WebSocket<TcpStream> {
    open(address, &address.to_string(), Some(&format!("http://{address}"))).unwrap()
}

fn say(socket: &mut WebSocket<TcpStream>, text: &str) {
    socket.send(Message::text(text.to_owned())).unwrap();
}

/// The next message with this type.
fn next(socket: &mut WebSocket<TcpStream>, kind: &str) -> String {
    let start = Instant::now();
    while start.elapsed() < PATIENCE {
        if let Message::Text(text) = socket.read().unwrap()
            && text.starts_with(&format!("{{\"type\":\"{kind}\""))
        {
            return text.to_string();
        }
    }
    panic!("no message of type {kind}");
}

#[test]
fn the_page_is_served_and_loads_nothing_from_elsewhere() {
    let address = server();
    let host = format!("Host: {address}");
    for path in ["/", "/live.css", "/live.js", "/draw.js", "/pad.js", "/icon.svg"] {
        let answer = answer(address, path, &[&host]);
        assert_eq!(status(&answer), 200, "{path}");
        assert!(answer.contains("content-security-policy: default-src 'none'"), "{path}");
        assert!(answer.contains("x-frame-options: DENY"), "{path}");
        let body = answer.split_once("\r\n\r\n").unwrap().1;
        let names = body.matches("http://").count() + body.matches("https://").count();
        // the icon names its format
        assert_eq!(names, usize::from(path == "/icon.svg"), "{path} names another address");
    }
    assert_eq!(status(&answer(address, "/other", &[&host])), 404);
}

#[test]
fn foreign_hosts_and_origins_are_refused() {
    let address = server();
    let port = address.port();
    let own_host = format!("Host: {address}");
    for host in ["Host: evil.example", "Host: 127.0.0.1:1", "X-Host: none"] {
        assert_eq!(status(&answer(address, "/", &[host])), 403, "{host}");
    }
    assert_eq!(status(&answer(address, "/", &[&format!("Host: evil.example:{port}")])), 403);
    for origin in ["http://evil.example", "null", "https://127.0.0.1"] {
        assert_eq!(status(&answer(address, "/live.js", &[&own_host, &format!("Origin: {origin}")])), 403, "{origin}");
    }
    for (host, origin) in [
        (format!("127.0.0.1:{port}"), Some("http://evil.example".to_owned())),
        (format!("127.0.0.1:{port}"), None),
        (format!("127.0.0.1:{port}"), Some("null".to_owned())),
        (format!("127.0.0.1:{port}"), Some(format!("http://evil.example:{port}"))),
        (format!("evil.example:{port}"), Some(format!("http://evil.example:{port}"))),
    ] {
        assert_eq!(open(address, &host, origin.as_deref()).map(drop), Err(403), "{host} {origin:?}");
    }
    for name in ["127.0.0.1", "localhost", "[::1]"] {
        let host = format!("{name}:{port}");
        assert!(open(address, &host, Some(&format!("http://{host}"))).is_ok(), "{host}");
    }
}

#[test]
fn bad_messages_are_answered_and_the_skin_goes_on() {
    let mut socket = own(server());
    next(&mut socket, "hello");
    for (text, fact) in [
        ("", "message: "),
        ("{", "message: "),
        ("[]", "message: "),
        ("{\"type\":\"shout\"}", "unknown variant"),
        ("{\"type\":\"press\",\"x_mm\":NaN,\"y_mm\":0,\"force_n\":1}", "message: "),
        ("{\"type\":\"press\",\"x_mm\":1e999,\"y_mm\":0,\"force_n\":1}", "message: "),
        ("{\"type\":\"press\",\"x_mm\":0,\"y_mm\":0,\"force_n\":1e9}", "`force_n` = 1000000000"),
        ("{\"type\":\"press\",\"x_mm\":0,\"y_mm\":0}", "missing field"),
        ("{\"type\":\"measurements\",\"count\":0}", "`count` = 0 is outside [5, 100]"),
        ("{\"type\":\"measurements\",\"count\":-3}", "message: "),
        ("{\"type\":\"panel\",\"panel\":0,\"decoder\":\"x\",\"rows\":\"random\",\"more\":1}", "more"),
        (&format!("{{\"type\":\"object\",\"name\":\"{}\"}}", "x".repeat(5000)), "bytes is outside [0, 4096]"),
    ] {
        say(&mut socket, text);
        let error = next(&mut socket, "error");
        assert!(error.contains(&fact.replace('"', "\\\"")), "{text}: {error}");
        next(&mut socket, "frame");
    }
    socket.send(Message::binary(vec![0; 10])).unwrap();
    assert!(next(&mut socket, "error").contains("bytes without a name"));
}

/// A thousand messages at once are all taken, and the last one counts.
#[test]
fn a_flood_of_messages_does_not_stop_the_updates() {
    let mut socket = own(server());
    next(&mut socket, "hello");
    for k in 0..1000 {
        say(&mut socket, &format!("{{\"type\":\"press\",\"x_mm\":{},\"y_mm\":0,\"force_n\":20}}", k % 50));
        say(&mut socket, "{\"type\":\"object\",\"name\":\"tennis\"}");
        say(&mut socket, &format!("{{\"type\":\"readout\",\"profile\":\"as_built\",\"noise\":{}}}", k % 10));
    }
    say(&mut socket, "{\"type\":\"object\",\"name\":\"tape\"}");
    while !next(&mut socket, "shape").contains("\"name\":\"tape\"") {}
    let number =
        |frame: String| frame.split("\"number\":").nth(1).unwrap().split(',').next().unwrap().parse::<u64>().unwrap();
    let first = number(next(&mut socket, "frame"));
    assert!(number(next(&mut socket, "frame")) > first);
}

#[test]
fn two_pages_have_skins_of_their_own() {
    let address = server();
    let (mut one, mut two) = (own(address), own(address));
    say(&mut one, "{\"type\":\"press\",\"x_mm\":0,\"y_mm\":0,\"force_n\":30}");
    (0..40).for_each(|_| drop(next(&mut one, "frame")));
    (0..10).for_each(|_| drop(next(&mut two, "frame")));
    assert!(next(&mut one, "frame").contains("\"force_n\":29.9") || next(&mut one, "frame").contains("\"force_n\":30"));
    assert!(next(&mut two, "frame").contains("\"force_n\":0.0"));
}

#[test]
fn no_more_pages_than_eight_are_served() {
    let address = server();
    let pages: Vec<_> = (0..8).map(|_| own(address)).collect();
    let origin = format!("http://{address}");
    assert_eq!(open(address, &address.to_string(), Some(&origin)).map(drop), Err(503));
    drop(pages);
    let start = Instant::now();
    while open(address, &address.to_string(), Some(&origin)).is_err() {
        assert!(start.elapsed() < PATIENCE, "places of closed pages are not given away");
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn a_mesh_presses_and_a_broken_one_is_refused() {
    let mut socket = own(server());
    let mut drop_file = |name: &str, bytes: &[u8], kind: &str| {
        say(&mut socket, &format!("{{\"type\":\"mesh\",\"name\":\"{name}\",\"unit\":\"guess\"}}"));
        socket.send(Message::binary(bytes.to_vec())).unwrap();
        next(&mut socket, kind)
    };
    let block = spts_contact::mesh::cuboid([40.0, 30.0, 20.0]).to_obj("block");
    assert!(drop_file("block.obj", block.as_bytes(), "mesh").contains("40 × 30 × 20 mm, 12 triangles"));
    assert!(drop_file("half.obj", &block.as_bytes()[..block.len() / 2], "error").contains("half.obj"));
    assert!(drop_file("noise.stl", &[7; 5000], "error").contains("noise.stl"));
    assert!(drop_file("virus.exe", &[0; 10], "error").contains("extension `exe`"));
    assert!(drop_file("block.obj", block.as_bytes(), "shape").contains("\"name\":\"block.obj\""));
}

/// More bytes than a mesh may have end the page, not the server.
#[test]
fn too_many_bytes_end_the_page_alone() {
    let address = server();
    let mut socket = own(address);
    // the server may close while it is sent
    let sent = socket.send(Message::binary(vec![0; (1 << 26) + 1]));
    let closed = sent.is_err() || (0..10_000).any(|_| socket.read().is_err());
    assert!(closed);
    next(&mut own(address), "frame");
}
