// What of cm-chessboard is used here; it has no types of its own.
declare module "cm-chessboard/src/Chessboard.js" {
  export interface InputEvent {
    readonly type: "moveInputStarted" | "movingOverSquare" | "validateMoveInput" | "moveInputCanceled" | "moveInputFinished";
    readonly squareFrom: string;
    readonly squareTo?: string | null;
  }
  export interface Props {
    position?: string;
    orientation?: "w" | "b";
    assetsUrl?: string;
    responsive?: boolean;
    style?: {
      cssClass?: string;
      showCoordinates?: boolean;
      animationDuration?: number;
      pieces?: { file: string };
    };
  }
  export class Chessboard {
    constructor(context: HTMLElement, props?: Props);
    readonly view: { handleResize(): void };
    setPosition(fen: string, animated?: boolean): Promise<void>;
    setOrientation(colour: "w" | "b", animated?: boolean): Promise<void>;
    getPosition(): string;
    enableMoveInput(handler: (event: InputEvent) => boolean | void, colour?: "w" | "b"): void;
    disableMoveInput(): void;
    cancelMoveInput(): void;
    isMoveInputEnabled(): boolean;
    destroy(): void;
  }
}
