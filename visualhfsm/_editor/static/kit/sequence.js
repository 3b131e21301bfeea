/** Work of which each piece begins after the one before it. */

export class Sequence {
  /** The end of the last piece, done or not. @type {Promise<unknown>} */
  #end = Promise.resolve();

  /**
   * Do some work after all that was added before; work that fails does not keep the next from being done.
   *
   * @template T
   * @param {() => Promise<T>} work
   * @returns {Promise<T>} its result
   */
  add(work) {
    const done = this.#end.then(work);
    this.#end = done.catch(() => {}); // the caller gets the error
    return done;
  }
}
