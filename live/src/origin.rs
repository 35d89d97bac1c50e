//! Who may speak with the server: pages that it served itself, on this machine.
//!
//! A name that a foreign page has resolve to 127.0.0.1 (DNS rebinding) stands in `Host`, and the page that a browser
//! sends a request for stands in `Origin`: both have to be this server.

use axum::body::Body;
use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse as _, Response};

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

/// Lets requests through that are meant for the server at this port and come from its own page; an upgrade to a
/// WebSocket has to say where it comes from.
pub(crate) async fn own_pages_only(State(port): State<u16>, request: Request<Body>, next: Next) -> Response {
    let mut response = match refusal(request.headers(), request.uri().authority().map(|a| a.as_str()), port) {
        None => next.run(request).await,
        Some(reason) => (StatusCode::FORBIDDEN, format!("{reason}\n")).into_response(),
    };
    for (name, value) in SAFE {
        response.headers_mut().insert(name, HeaderValue::from_static(value));
    }
    response
}

/// Why a request is refused.
fn refusal(headers: &HeaderMap, authority: Option<&str>, port: u16) -> Option<String> {
    let hosts: Vec<Option<&str>> = headers.get_all(header::HOST).iter().map(|v| v.to_str().ok()).collect();
    let own_host = matches!(hosts.as_slice(), [Some(host)] if is_own(host, port));
    if !own_host || authority.is_some_and(|authority| !is_own(authority, port)) {
        return Some(format!(
            "This server answers at http://127.0.0.1:{port}/ alone: the header Host is another one."
        ));
    }
    let origins: Vec<Option<&str>> = headers
        .get_all(header::ORIGIN)
        .iter()
        .map(|v| v.to_str().ok())
        .collect();
    let own_origin = match origins.as_slice() {
        [] => !headers.contains_key(header::UPGRADE),
        [Some(origin)] => origin.strip_prefix("http://").is_some_and(|host| is_own(host, port)),
        _ => false,
    };
    (!own_origin)
        .then(|| "This server speaks with its own page alone: the header Origin is missing or another one.".to_owned())
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

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(headers: &[(&str, &str)]) -> bool {
        let mut map = HeaderMap::new();
        for (name, value) in headers {
            map.append(HeaderName::from_bytes(name.as_bytes()).unwrap(), value.parse().unwrap());
        }
        refusal(&map, None, 7117).is_some()
    }

    #[test]
    fn own_hosts_and_origins_alone_are_let_in() {
        let upgrade = ("upgrade", "websocket");
        for host in ["127.0.0.1:7117", "localhost:7117", "LOCALHOST:7117", "[::1]:7117"] {
            let host = ("host", host);
            assert!(!refused(&[host]), "{host:?}");
            assert!(
                !refused(&[host, upgrade, ("origin", "http://localhost:7117")]),
                "{host:?}"
            );
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

    /// A browser that asks for port 80 does not write it.
    #[test]
    fn port_80_need_not_be_written() {
        assert!(is_own("localhost", 80) && !is_own("localhost", 8080) && is_own("[::1]", 80));
    }
}
