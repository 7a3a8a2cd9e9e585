#!/bin/sh
# Tries a package in a bare Debian that is thrown away afterwards, as root:
#   sh check_deb.sh lightpen_<version>_amd64.deb
# Prints what it tries; the exit status is 1 if anything is not as it must be.
set -u
package=$(realpath -- "$1")
work=$(mktemp -d)
readonly ENTRY=/usr/share/applications/lightpen.desktop
troubles=0
export DEBIAN_FRONTEND=noninteractive QT_QPA_PLATFORM=offscreen HOME="$work"
cd -- "$work" || exit 1

# expect WHAT COMMAND...: it ends with 0
expect() {
    what=$1
    shift
    if "$@" >said 2>&1; then
        echo "ok   $what"
    else
        echo "FAIL $what"
        tail -n 20 said
        troubles=$((troubles + 1))
    fi
}

ends_with() {
    status=$1
    shift
    "$@"
    test $? -eq "$status"
}

menu_entry_opens_a_window() {
    program=$(sed -n 's/^Exec="\(.*\)" open %f$/\1/p' "$ENTRY" | head -n 1)
    "$program" open &
    seconds=0
    # A job that the running window starts writes this.
    until test -e "$HOME/.local/share/lightpen/simulated/pen.json" ||
        test "$seconds" -ge 120; do
        sleep 1
        seconds=$((seconds + 1))
    done
    kill $! && test "$seconds" -lt 120
}

is_version_of_package() {
    stated=$(dpkg-deb --field "$package" Version | sed 's/+.*//; s/~//')
    test "$(lightpen --version)" = "$stated"
}

is_gone() {
    test ! -e /opt/lightpen && test ! -e /usr/bin/lightpen && test ! -e "$ENTRY"
}

apt-get -q update >/dev/null
expect "installs" apt-get -q -y install --no-install-recommends "$package"
expect "its version is the package's" is_version_of_package
expect "self-test: files, libraries, fonts, the tip" lightpen --self-test report.json
expect "extras load" /opt/lightpen/bin/python -c \
    "import harvesters.core, psycopg, pyigtl, python_calamine"
expect "demo accepts its tip" lightpen --demo
expect "a file that is missing is named" ends_with 2 lightpen /no/such.lightpen
expect "menu entry opens a window" menu_entry_opens_a_window
expect "is removed" apt-get -q -y remove lightpen
expect "and leaves nothing" is_gone
rm -rf -- "$work"
echo "$troubles troubles"
test "$troubles" -eq 0
