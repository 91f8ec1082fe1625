import { expect, it } from "vitest";
import { isLoopback } from "./loopback";

it("tells this computer's own addresses from those that others can open", () => {
  expect(["127.0.0.1", "127.8.8.8", "localhost", "robot.localhost", "[::1]"].every((host) => isLoopback(host))).toBe(true);
  expect(["192.168.1.7", "robot.local", "[fe80::1]", "localhost.example"].some((host) => isLoopback(host))).toBe(false);
});
