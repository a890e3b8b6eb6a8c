# SPDX-License-Identifier: MIT
# Tasks that every recipe has: fetch -> unpack -> build. Local files and directories by BitBake's own
# fetcher; Debian source packages and PyPI archives by the classes that name them.

def base_set_filespath(path, d):
    """The search path of file:// entries: FILESEXTRAPATHS first, then the folders of the recipe."""
    filespath = []
    extra = d.getVar("FILESEXTRAPATHS") or ""
    paths = [p for p in extra.split(":") if p and p != "__default"] + path
    for base in paths:
        filespath += [os.path.join(base, o) for o in d.getVar("FILESOVERRIDES").split(":")[::-1]]
        filespath.append(base)
    return ":".join(filespath)

def local_sources(d):
    """SRC_URI entries that BitBake's fetcher takes: everything but apt://."""
    return [u for u in (d.getVar("SRC_URI") or "").split() if not u.startswith("apt://")]

addtask fetch
do_fetch[dirs] = "${DL_DIR}"
do_fetch[network] = "1"
python do_fetch() {
    uris = local_sources(d)
    if uris:
        bb.fetch2.Fetch(uris, d).download()
}

addtask unpack after do_fetch
do_unpack[cleandirs] = "${S}"
python do_unpack() {
    uris = local_sources(d)
    if uris:
        bb.fetch2.Fetch(uris, d).unpack(d.getVar("WORKDIR"))
}

addtask build after do_unpack
do_build[noexec] = "1"
do_build[nostamp] = "1"
do_build() {
    :
}

# Progress that a person can follow, and one way to fail.
bbnote() {
	echo "NOTE: $*"
}
bbwarn() {
	echo "WARNING: $*"
}
bbfatal() {
	echo "ERROR: $*" >&2
	exit 1
}
die() {
	bbfatal "$*"
}

# Isar becomes root for these; here the whole build is root's.
run_privileged() {
	"$@"
}
