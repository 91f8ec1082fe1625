// What the operator's pages read and write over HTTP.
import type { components } from "../api/schema";
import { get, getBlob, post, put } from "../api/http";
import { t } from "../i18n/i18n.svelte";

type Schemas = components["schemas"];

export type AboutView = Schemas["AboutView"];
export type CheckView = Schemas["CheckView"];
export type DoctorView = Schemas["DoctorView"];
export type FindingView = Schemas["FindingView"];
export type FitView = Schemas["FitView"];
export type GeometryView = Schemas["GeometryView"];
export type LogLine = Schemas["LogLine"];
export type MeasuredView = Schemas["MeasuredView"];
export type ParameterView = Schemas["ParameterView"];
export type PieceShape = Schemas["PieceShape"];
export type PortsView = Schemas["PortsView"];
export type PortView = Schemas["PortView"];
export type ShapeConfig = Schemas["ShapeConfig"];
export type TableFormView = Schemas["TableForm"];
export type TableView = Schemas["TableView"];
export type Tray = Schemas["Tray"];
export type WireLine = Schemas["WireLine"];

/** What a kind of robot is called; one that somebody has added goes by its own name. */
export const kindName = (kind: string) => (kind === "gantry" || kind === "arm" ? t(`operator.kind_${kind}`) : kind);
export const lastScan = () => get<PortsView>("ports");
export const scan = (address: string) => post<PortsView>("ports/scan", { address });
export const table = () => get<TableView>("table");
export const fit = (form: TableFormView) => post<FitView>("fit", form);
export const saveTable = (form: TableFormView) => put<TableView>("table", form);
export const measured = () => get<MeasuredView>("calibration");
export const parameters = () => get<readonly ParameterView[]>("eyes/parameters");
export const wireLines = async (limit: number) => (await get<Schemas["WireView"]>(`logs/wire?limit=${limit}`)).lines;
export const programLines = async (after: number) =>
  (await get<Schemas["LogView"]>(`logs/program?after=${after}&limit=1000`)).lines;
export const about = () => get<AboutView>("about");
export const lastDoctor = () => get<DoctorView | null>("about/doctor");
export const examine = () => post<DoctorView>("about/doctor", {});
export const picture = (query: string, signal: AbortSignal) => getBlob(`eyes/picture?${query}`, signal);
