  # Without TLS everybody on the cluster's network can connect. `--insecure` accepts that.
  "$runout" serve "$run_directory/campaign.toml" --out "$run_directory" --listen "$address:0" --insecure \
    --grace {{GRACE_S}} &
