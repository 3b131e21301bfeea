// Objects with events, whose details are typed.

/** A listener for an event with a detail. */
export type Listener<Detail> = (event: CustomEvent<Detail>) => void;

/** An object with events; `Details` has what each carries as its detail, by their names. */
export type Target<Details> = Omit<EventTarget, "addEventListener" | "removeEventListener"> & {
  readonly details?: Details;
  addEventListener<Kind extends keyof Details & string>(
    kind: Kind,
    heard: Listener<Details[Kind]>,
    options?: AddEventListenerOptions,
  ): void;
  removeEventListener<Kind extends keyof Details & string>(kind: Kind, heard: Listener<Details[Kind]>): void;
};
