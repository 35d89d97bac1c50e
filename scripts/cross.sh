# Sourced with a TARGET: sees to a compiler that has its standard library. rustup's when it has it or can fetch it;
# else, for Linux, Debian's, whose package libstd-rust-web-dev has one for each of its architectures.
if ! [ -d "$(rustc --print sysroot)/lib/rustlib/$1/lib" ] && ! rustup target add "$1" >/dev/null 2>&1; then
  if [ -d "/usr/lib/rustlib/$1/lib" ]; then
    export RUSTC=/usr/bin/rustc
  else
    echo "no standard library for $1: \`rustup target add $1\`, or Debian's rustc-web with libstd-rust-web-dev:arm64" >&2
    exit 1
  fi
fi
# messages name files as here, not as on the machine that builds
export RUSTFLAGS="--remap-path-prefix=$PWD=. --remap-path-prefix=${CARGO_HOME:-$HOME/.cargo}/registry/src=crates"
