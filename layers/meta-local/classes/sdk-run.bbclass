# SPDX-License-Identifier: MIT
# Work inside the SDK chroot (sdk-chroot.bb). Each call has a mount namespace of its own, in which the
# chroot is below an overlay: what a package installs there is gone afterwards, and nothing stays
# mounted, however the call ends.

# Where a recipe's WORKDIR is seen inside, as in Isar.
PP = "/home/builder/${BPN}"

# sdk_run [-w] COMMAND [ARGUMENT...]: as root inside; -w also writes to the chroot itself.
sdk_run() {
	layer=yes
	if [ "$1" = -w ]; then
		layer=no
		shift
	fi
	unshare --mount --pid --fork --kill-child --propagation private \
		sh -euc '
		sdk=$1 workdir=$2 pp=$3 ccache=$4 layer=$5
		shift 5
		mkdir -p "$workdir" "$ccache"
		if [ "$layer" = yes ]; then
			scratch=$workdir/scratch
			mkdir -p "$scratch"
			mount -t tmpfs -o mode=755 scratch "$scratch"
			mkdir "$scratch/upper" "$scratch/work" "$scratch/root"
			mount -t overlay -o "lowerdir=$sdk,upperdir=$scratch/upper,workdir=$scratch/work" \
				overlay "$scratch/root"
			sdk=$scratch/root
		fi
		mkdir -p "$sdk$pp" "$sdk/ccache"
		mount --bind "$workdir" "$sdk$pp"
		mount --bind "$ccache" "$sdk/ccache"
		mount -t proc proc "$sdk/proc"
		mount --bind /dev "$sdk/dev"
		for file in resolv.conf hosts; do
			if [ -e "/etc/$file" ]; then
				cp -L "/etc/$file" "$sdk/etc/$file"
			fi
		done
		exec chroot "$sdk" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LC_ALL=C.UTF-8 \
			DEBIAN_FRONTEND=noninteractive SOURCE_DATE_EPOCH="$SOURCE_DATE_EPOCH" \
			PARALLEL_MAKE="$PARALLEL_MAKE" CCACHE_DIR=/ccache "$@"
		' sdk-run "${SDK_DIR}" "${WORKDIR}" "${PP}" "${CCACHE_DIR}" "$layer" "$@"
}
export PARALLEL_MAKE
sdk_run[vardepsexclude] = "SDK_DIR WORKDIR CCACHE_DIR"

# In vardeps of a task that takes packages: it runs again when the archive is another.
def archive_vardeps(d):
    return "ECDAQ_ARCHIVE" if d.getVar("ECDAQ_ARCHIVE") else ""

# The machine's own Debian mirrors: $ECDAQ_APT_MIRROR and $ECDAQ_APT_SECURITY_MIRROR, else what apt is set up
# with. With a mirror given and none for security there is no security suite: its place cannot be guessed.
def apt_sources(d, suite, components):
    import re
    import subprocess
    mirror = d.getVar("ECDAQ_APT_MIRROR")
    security = d.getVar("ECDAQ_APT_SECURITY_MIRROR")
    if not mirror:
        # What apt would ask for; it needs no package lists for that.
        uris = subprocess.run(["apt-get", "update", "--print-uris"], check=True,
                              capture_output=True, text=True).stdout
        sites = {name: site for site, name in re.findall(r"'(\S+?)/dists/(\S+?)/InRelease'", uris)}
        mirror = next((sites[n] for n in ("bookworm", "trixie", "forky", "sid") if n in sites), None)
        found = (site for name, site in sites.items() if name.endswith("-security"))
        security = security or next(found, None)
    if not mirror:
        bb.fatal("no Debian mirror in this machine's apt sources: give one in ECDAQ_APT_MIRROR")
    lines = [f"deb {mirror} {suite} {components}", f"deb {mirror} {suite}-updates {components}"]
    if security:
        lines.append(f"deb {security} {suite}-security {components}")
    return lines

# apt-get with lists and cache of its own in a folder: apt_run(FOLDER, SOURCES, SETTINGS, ARGUMENT...). What it said.
def apt_run(folder, sources, settings, *arguments):
    for name in ("lists/partial", "cache"):
        os.makedirs(os.path.join(folder, name), exist_ok=True)
    with open(os.path.join(folder, "sources.list"), "w") as file:
        file.write("".join(line + "\n" for line in sources))
    settings = {"Dir::State::Lists": folder + "/lists", "Dir::Cache": folder + "/cache",
                "Dir::Etc::SourceList": folder + "/sources.list", "Dir::Etc::SourceParts": "-",
                "Acquire::IndexTargets::deb::DEP-11::DefaultEnabled": "false",
                "Acquire::Languages": "none", "Acquire::Retries": "3", "APT::Sandbox::User": "root"} | settings
    options = [word for item in settings.items() for word in ("-o", "=".join(item))]
    said, _ = bb.process.run(["apt-get", "-q", *options, *arguments])
    return said
