# SPDX-License-Identifier: MIT
# Source archives from the Python package registry, by the machine's own pip configuration: no host is
# named here. Set PYPI_PACKAGE, PYPI_VERSION, PYPI_ARCHIVE and PYPI_SHA256.
PYPI_PYTHON ??= "${@d.getVar('ECDAQ_PYTHON') or 'python3'}"
PYPI_ARCHIVE ??= "${PYPI_PACKAGE}-${PYPI_VERSION}.tar.gz"

do_fetch[network] = "1"
do_fetch[postfuncs] += "pypi_fetch"
do_fetch[vardeps] += "pypi_fetch"
do_unpack[postfuncs] += "pypi_unpack"
do_unpack[vardeps] += "pypi_unpack"
pypi_fetch[vardepsexclude] += "PYPI_PYTHON"

pypi_fetch() {
	mkdir -p "${DL_DIR}/pypi"
	archive=${DL_DIR}/pypi/${PYPI_ARCHIVE}
	if echo "${PYPI_SHA256}  $archive" | sha256sum --quiet --check > /dev/null 2>&1; then
		return 0
	fi
	echo "${PYPI_PACKAGE}==${PYPI_VERSION} --hash=sha256:${PYPI_SHA256}" > "${WORKDIR}/pypi.txt"
	${PYPI_PYTHON} -m pip download --quiet --no-deps --no-binary ${PYPI_PACKAGE} --require-hashes \
		--dest "${DL_DIR}/pypi" --requirement "${WORKDIR}/pypi.txt"
	echo "${PYPI_SHA256}  $archive" | sha256sum --quiet --check
}

pypi_unpack() {
	mkdir -p "${S}"
	tar -xf "${DL_DIR}/pypi/${PYPI_ARCHIVE}" --no-same-owner --strip-components=1 -C "${S}"
}
