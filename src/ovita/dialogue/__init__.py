"""Phase five: feedback. Turns, their history, and the session that keeps them."""
