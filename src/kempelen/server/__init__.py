"""The web server: HTTP and one WebSocket over a station (`kempelen.app.station`), and the built web page."""
