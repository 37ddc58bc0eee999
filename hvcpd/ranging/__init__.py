"""How far another robot is: when sentences that both said arrived, and the distance that follows from it."""
