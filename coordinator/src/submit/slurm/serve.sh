  "$runout" serve "$run_directory/campaign.toml" --out "$run_directory" --listen "$address:0" \
    --tls "$run_directory/tls" --grace {{GRACE_S}} &
