# SPDX-License-Identifier: MIT
# A kernel of its own configuration: .cfg files of SRC_URI merged over KERNEL_DEFCONFIG, by the very
# commands that Isar's class of this name uses. One package, linux-image-${KERNEL_NAME_PROVIDED}. A symbol
# that was requested and is not in the final configuration fails the build before it starts.
inherit dpkg

KERNEL_NAME_PROVIDED ?= "${@d.getVar('BPN').partition('linux-')[2]}"
KERNEL_DEFCONFIG ??= "defconfig"
KERNEL_FRAGMENTS = "${@' '.join(os.path.basename(u)[7:] if u.startswith('file:///') else u[7:].split(';')[0] for u in d.getVar('SRC_URI').split() if u.startswith('file://') and u.split(';')[0].endswith('.cfg'))}"

do_prepare_build[file-checksums] += "${LAYERDIR_core}/lib/kconfig.py:True"
do_prepare_build() {
	rm -rf "${S}/debian"
	deb_debianize
	source_version=$(sed -n 's/^Version: //p' "${WORKDIR}"/apt-source/*.dsc)
	cat > "${S}/debian/control" <<CONTROL
Source: ${BPN}
Section: kernel
Priority: optional
Standards-Version: ${DEBIAN_STANDARDS_VERSION}
Maintainer: ${MAINTAINER}
Build-Depends: debhelper-compat (= ${DEBIAN_COMPAT}), bc, bison, flex, kmod, rsync

Package: linux-image-${KERNEL_NAME_PROVIDED}
Architecture: ${PACKAGE_ARCH}
Depends: kmod
Built-Using: ${APT_SOURCE} (= $source_version)
Description: ${DESCRIPTION}
CONTROL
	install -d "${S}/debian/fragments"
	for name in ${KERNEL_FRAGMENTS}; do
		cp "${WORKDIR}/$name" "${S}/debian/fragments/"
	done
	cp "${LAYERDIR_core}/lib/kconfig.py" "${S}/debian/"
	cat > "${S}/debian/rules" <<'RULES'
#!/usr/bin/make -f
export ARCH = arm64
export CROSS_COMPILE = aarch64-linux-gnu-
export KBUILD_BUILD_TIMESTAMP = @$(SOURCE_DATE_EPOCH)
export KBUILD_BUILD_USER = ecdaq
export KBUILD_BUILD_HOST = ecdaq
unexport CFLAGS CPPFLAGS LDFLAGS CXXFLAGS
flags = KCFLAGS=-fdebug-prefix-map=$(CURDIR)=. KAFLAGS=-fdebug-prefix-map=$(CURDIR)=.
kmake = $(MAKE) -s O=build-full $(flags)
root = $(CURDIR)/debian/@PACKAGE@

%:
	dh $@

override_dh_auto_configure:
	mkdir -p build-full
	$(kmake) defconfig KBUILD_DEFCONFIG=@DEFCONFIG@
	scripts/kconfig/merge_config.sh -O build-full/ build-full/.config \
		$(addprefix debian/fragments/,@FRAGMENTS@)
	python3 debian/kconfig.py build-full/.config $(addprefix debian/fragments/,@FRAGMENTS@)

override_dh_auto_build:
	$(kmake) $(PARALLEL_MAKE) Image modules dtbs

override_dh_auto_install:
	krel=$$($(MAKE) -s O=build-full kernelrelease) && \
	install -D -m 644 build-full/arch/arm64/boot/Image $(root)/boot/vmlinux-$$krel && \
	install -D -m 644 build-full/.config $(root)/boot/config-$$krel && \
	install -D -m 644 build-full/System.map $(root)/boot/System.map-$$krel && \
	ln -s vmlinux-$$krel $(root)/boot/vmlinux && \
	$(kmake) INSTALL_MOD_PATH=$(root)/usr INSTALL_MOD_STRIP=1 modules_install && \
	rm -f $(root)/usr/lib/modules/$$krel/build && \
	$(kmake) INSTALL_DTBS_PATH=$(root)/usr/lib/linux-image-$$krel dtbs_install

override_dh_auto_test override_dh_strip override_dh_dwz override_dh_makeshlibs override_dh_shlibdeps:
RULES
	sed -i -e 's/@PACKAGE@/linux-image-${KERNEL_NAME_PROVIDED}/' -e 's/@DEFCONFIG@/${KERNEL_DEFCONFIG}/' \
		-e 's/@FRAGMENTS@/${KERNEL_FRAGMENTS}/' "${S}/debian/rules"
	chmod 755 "${S}/debian/rules"
}
