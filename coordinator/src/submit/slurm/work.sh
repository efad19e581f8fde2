  "$worker" --run-directory "$run_directory" --tls "$run_directory/tls" --slots {{SLOTS}} --name "$(hostname)-$task" \
    --spool "$run_directory/spool" --give-up-after "$(left)" --leave-after "$(left)" --grace {{GRACE_S}} &
