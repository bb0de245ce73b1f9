"""See `building`."""

from scenarios.ahead.building import main

main()
