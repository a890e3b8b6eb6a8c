# SPDX-License-Identifier: MIT
# The key that signs updates, where none is given. build-image.sh and build-bundle.sh read this.
# shellcheck shell=sh
development=${XDG_CACHE_HOME:-$HOME/.cache}/ecdaq/update-keys
development_name="ecdaq development key, not for releases"

make_development_key()
{
	[ ! -f "$development/cert.pem" ] || return 0
	mkdir -p "$development"
	(
		umask 077
		openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days 7300 \
			-subj "/CN=$development_name" -keyout "$development/key.pem" \
			-out "$development/cert.new" 2> "$development/log"
	) || die "openssl cannot make a key: $(tail -n 1 "$development/log")"
	mv "$development/cert.new" "$development/cert.pem"
}

# is_for_development FILE: whether one of its certificates is such a key's.
is_for_development()
{
	openssl crl2pkcs7 -nocrl -certfile "$1" | openssl pkcs7 -print_certs -noout |
		grep -qF "$development_name"
}
