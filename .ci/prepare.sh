# Shared by ./run and ./test: install what is missing, configure, build. Source it at the repository's root.

# missing_packages <list>…: packages of these lists that are not installed.
missing_packages() {
  cat "$@" |
  while read -r package; do
    dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q '^install ok installed' || echo "$package"
  done
}

as_root() {
  if [ "$(id -u)" -eq 0 ]; then "$@"; else sudo "$@"; fi
}

# install_packages [list]…: those of .ci/packages.txt, and of further lists.
install_packages() {
  # Elsewhere CMake says which library it does not find.
  command -v dpkg-query > /dev/null && command -v apt-get > /dev/null || return 0
  local missing
  missing=$(missing_packages .ci/packages.txt "$@" | tr '\n' ' ')
  [ -n "$missing" ] || return 0
  if [ "$(id -u)" -ne 0 ] && ! command -v sudo > /dev/null; then
    echo "Missing packages: ask an administrator for 'apt-get install $missing'" >&2
    return 1
  fi
  echo "Installing $missing"
  as_root apt-get update -qq
  # shellcheck disable=SC2086  # one word a package
  as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $missing
}

# build <target>…: the release build of these targets, quietly unless something is wrong.
build() {
  cmake --preset release --log-level=WARNING
  cmake --build --preset release --target "$@"
}
