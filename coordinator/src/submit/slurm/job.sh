say() { echo "$(date '+%F %T') $*"; }

stopping=false
interrupted=false
child=

# Waits for the child's end, also when a signal comes meanwhile; its exit code is in $code.
wait_for_child() {
  local last
  while :; do
    interrupted=false
    wait "$child"
    last=$?
    [ "$last" -ne 127 ] || break
    code=$last
    $interrupted || break
  done
  child=
}
