// Whether the page was opened at an address that means "this computer" on every other one, too.
export function isLoopback(host: string = location.hostname): boolean {
  return host === "localhost" || host.endsWith(".localhost") || host === "[::1]" || /^127\./.test(host);
}
